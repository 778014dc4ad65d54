"""Host side of LiteStereo: devices, link protocol, images, metrics and the `litestereo` command."""
