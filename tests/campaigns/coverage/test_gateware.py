#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Lines of the gateware that cannot run, and so do not count."""

from campaigns.coverage.gateware import dead_lines

VERILOG = """\
reg part_reset = 1'd0;
reg whole_reset = 1'd0;
wire settings_reset;
reg [1:0] count = 2'd0;
assign settings_reset = count[0];
always @(posedge clk) begin
    if (part_reset) begin
        if (enable) begin
            count <= 2'd0;
        end
    end
    if (settings_reset) begin
        count <= 2'd1;
    end
    if (whole_reset) begin
        count <= 2'd2;
    end
    whole_reset <= enable;
end
"""


def test_dead_lines():
    """Lines under a register that nothing drives are dead, up to its end; lines under a driven one are not."""
    assert dead_lines(VERILOG) == {7, 8, 9, 10, 11}
    assert dead_lines(VERILOG.replace("whole_reset <= enable", "count <= 2'd3")) == {7, 8, 9, 10, 11, 15, 16, 17}
    assert dead_lines(VERILOG.replace("whole_reset <=", "part_reset <=")) == {15, 16, 17}
