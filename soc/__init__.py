"""The LiteX SoC: one class for simulation and boards, and the method that adds a matcher to any SoC."""
