#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Boards: every target up to Verilog and linked programs, the checks of a bitstream, and the command of a target."""

from __future__ import annotations

import json
import re
import shutil
import zlib
from dataclasses import replace

import pytest

from litestereo.firmware import FIRMWARE_DIR
from litestereo.sim.socs.flash_model import flash_model_bytes
from litestereo.soc.boards import BOARDS, OPEN_BOARDS, VENDOR_TOOLS, soc_class
from litestereo.soc.boards.board_soc import FLASH_RECORDS_BYTES
from litestereo.soc.build.tools import ToolError
from litestereo.soc.flow import bitstream, check, flash_room, loader, sources, target, vendor
from litestereo.soc.flow.synthesis import Resources
from litestereo.soc.reports import boards
from support.pairs import byte_generator

#: Bytes of the flash on each board.
FLASH_BYTES = {"colorlight_i5": 2 << 20, "colorlight_i9": 8 << 20, "ulx3s": 16 << 20, "ecpix5": 32 << 20,
               "arty": 16 << 20, "atlys": 16 << 20, "tang_primer_20k": 4 << 20}


def built(board, achieved=61.0, key="key"):
    """Return what `build` writes for a board whose only clock needs 60 MHz."""
    return {"board": board, "device": "a device", "key": key, "tools": ["a tool"], "commit": "a commit",
            "preset": json.loads(json.dumps(vars(soc_class(board).preset))),
            "flash": {"offset": 4096, "bytes": 1024, "images": 2},
            "report": {"fmax": {"$glbnet$sys_clk": {"achieved": achieved, "constraint": 60.0}},
                       "utilization": {kind: {"used": 1, "available": 2} for kind in boards.SITES}}}


def assert_pins_are_driven_once(verilog):
    """Check that a bidirectional pin has only its tristate drivers: an `always` would drive all of its bits."""
    pins = re.findall(r"^\s*inout\s+wire\s+(?:\[\d+:0\]\s+)?(\w+)", verilog, re.MULTILINE)
    for pin in pins:
        assert not re.search(rf"\b{pin}(\[[\d:]+\])?\s*<=", verilog), pin


@pytest.mark.parametrize("board", OPEN_BOARDS)
def test_sources(board, monkeypatch):
    """A board's Verilog, constraints, boot program and firmware are built; the boot program fits its ROM."""
    monkeypatch.setattr(bitstream, "tool_version", lambda name: name)
    made  = sources.sources(board)
    files = bitstream.synthesis_files(made)
    assert "module top" in files["top.v"].replace("  ", " ")
    assert_pins_are_driven_once(files["top.v"])
    assert made.firmware.stat().st_size < made.board["flash"]["bytes"]
    assert len(files["top_rom.init"].split())*4 >= made.boot.stat().st_size
    # No file outside the folder is read: the tools would not find it.
    assert "/" not in files["top.ys"].replace("//", "")
    assert "FREQUENCY PORT" in bitstream.constraints(made)
    assert "--timing-allow-fail" not in bitstream.options(made)


#: Inputs of each vendor's tool: its script, and the board's pins and clocks.
VENDOR_FILES = {"tang_primer_20k": ("run.tcl", "top.cst"),
                "arty":            ("top.tcl", "top.xdc"),
                "atlys":           ("top.prj", "top.ucf")}


@pytest.mark.long
@pytest.mark.parametrize("board", VENDOR_TOOLS)
def test_vendor_sources(board, monkeypatch, tmp_path):
    """A vendor's tool has all its inputs: the script names files in the folder, and the ROM holds the boot program."""
    monkeypatch.setattr(vendor, "build_directory", lambda: tmp_path)
    monkeypatch.setattr(vendor, "tool_version", lambda name: name)
    made     = sources.sources(board)
    folder   = vendor.deliver(made, Resources(1, 1, 1, 1, 1))
    gateware = folder / "gateware"
    script, constraints = ((gateware / name).read_text() for name in VENDOR_FILES[board])
    assert str(made.folder) not in script
    verilog = (gateware / "top.v").read_text()
    assert "inout" in verilog
    assert_pins_are_driven_once(verilog)
    for name in ("top.v", "VexRiscv_Lite.v"):
        assert name in script
        assert (gateware / name).is_file()
    assert "serial_tx" in constraints
    words = [int(word, 16) for word in (gateware / "top_rom.init").read_text().split()]
    assert b"".join(word.to_bytes(4, "little") for word in words).startswith(made.boot.read_bytes())
    assert len(words)*4 <= made.board["rom"]
    assert (folder / "firmware.bin").read_bytes() == sources.flash_image(made.firmware.read_bytes())
    assert json.loads((folder / "report.json").read_text())["counts"]["lut"] == 1
    # There is no bitstream until the vendor's tool has run.
    monkeypatch.setattr(loader, "build_directory", lambda: tmp_path)
    with pytest.raises(ToolError, match=f"{VENDOR_TOOLS[board]} makes it"):
        loader.bitstream(board)


def test_clock_names():
    """Clocks have the names of the board's constraints."""
    assert [check.clock_name(net) for net in ("$glbnet$sys_clk", "$glbnet$eth_clocks_rx$TRELLIS_IO_IN")] == [
        "sys_clk", "eth_clocks_rx"]


def test_boards_fit_the_flash():
    """Images come after the bitstream and do not overlap; the records follow them."""
    for board in BOARDS:
        soc   = soc_class(board)
        first = soc.flash_offset + soc.flash_images*soc.flash_image_bytes
        # The model of the flash holds only images and records, from address 0.
        size = flash_model_bytes(soc.flash_images*soc.flash_image_bytes + soc.flash_records_bytes)
        assert soc.flash_offset % size == 0 and size & (size - 1) == 0
        assert soc.flash_images >= 2
        # Whole blocks of 64 KiB, so that neither shares a sector of any size with the other or with the bitstream.
        assert soc.flash_offset % 65536 == first % 65536 == soc.flash_records_bytes % 65536 == 0
        assert first + soc.flash_records_bytes <= FLASH_BYTES[board]


def test_records_fit_their_region():
    """The gateware's size of the records is the sum that the firmware's numbers give."""
    header = (FIRMWARE_DIR / "include/litestereo/records.h").read_text()
    kinds  = int(re.search(r"RECORD_KINDS = (\d+)", header)[1])
    copy   = int(re.search(r"RECORD_COPY_BYTES \((\d+) \* FLASH_SECTOR_BYTES\)", header)[1])*4096
    assert kinds*2*copy == FLASH_RECORDS_BYTES


def test_flash_image():
    """Length and CRC-32 precede the firmware, little-endian."""
    image = sources.flash_image(b"firmware")
    assert image == (8).to_bytes(4, "little") + zlib.crc32(b"firmware").to_bytes(4, "little") + b"firmware"


def test_boot_program_that_is_too_large():
    """The program is refused, with a remedy."""
    assert sources.rom_contents(b"\1\2\3\4\5", 8) == "04030201\n00000005\n"
    with pytest.raises(ToolError, match="enlarge rom_bytes"):
        sources.rom_contents(bytes(9), 8)


def test_check():
    """A bitstream is refused if a clock is too slow, if there is no clock, or if its sources have changed."""
    check.check("ulx3s", "key", built("ulx3s"))
    with pytest.raises(ToolError, match="sys_clk reaches 59.9 MHz of 60.0 MHz"):
        check.check("ulx3s", "key", built("ulx3s", achieved=59.9))
    with pytest.raises(ToolError, match="older than its sources"):
        check.check("ulx3s", "another", built("ulx3s"))
    with pytest.raises(ToolError, match="no clocks"):
        check.check_clocks("ulx3s", {"fmax": {}})


def test_not_built(tmp_path):
    """A board without a bitstream is named, with a remedy."""
    with pytest.raises(ToolError, match="run make bitstream BOARD=ulx3s"):
        check.delivered("ulx3s", tmp_path)


def test_document():
    """Every built board has its sites and clocks in the document; one that is too slow is refused."""
    text = boards.document({board: built(board) for board in OPEN_BOARDS}, {"arty": Resources(1, 2, 3, 4.5, 5)})
    assert "| [arty](boards/arty.md) | Vivado | 1 of 20800 | 3 of 41600 | 4.5 of 50 | 5 of 90 |" in text
    for board in OPEN_BOARDS:
        assert f"| {board} | `sys_clk` | 60.0 | 61.0 |" in text
    assert "passes, on that computer: none." in text
    # The fastest first: 128 disparities at 75 MHz are between two others.
    order = [text.index(name) for name in ("Grabowski", "Vitis StereoBM, 15x15", "LiteStereo, ulx3s", "Wang", "OpenMV")]
    assert order == sorted(order)
    one = boards.document({"ulx3s": built("ulx3s")}, {})
    assert "passes, on that computer: colorlight_i5, colorlight_i9, ecpix5." in one
    with pytest.raises(ToolError):
        boards.document({"ulx3s": built("ulx3s", achieved=1.0)}, {})


def test_changed_preset():
    """A bitstream that differs from the preset is reported as such."""
    other = built("ulx3s")
    assert check.changes(other, soc_class("ulx3s").preset) == {}
    other["preset"]["disparities"] = 16
    assert check.changes(other, soc_class("ulx3s").preset) == {"disparities": 16}


@pytest.mark.parametrize("board", BOARDS)
def test_target(board, monkeypatch, capsys):
    """A target's options change its preset; without an action it prints them."""
    calls = []
    monkeypatch.setattr(target, "build", lambda *arguments: calls.append(arguments))
    monkeypatch.setattr(target, "flash", lambda *arguments: calls.append(arguments))
    assert target.main(board, []) == 0
    assert "--disparities" in capsys.readouterr().out
    assert target.main(board, ["--build", "--flash"]) == 0
    assert target.main(board, ["--build", "--disparities", "48", "--features", "raw", "--no-with-icmp"]) == 0
    changed = {"disparities": 48, "features": ["raw"]}
    if soc_class(board).preset.with_icmp:
        changed["with_icmp"] = False
    assert calls == [(board, {}), (board,), (board, changed)]


@pytest.mark.parametrize("board, changes, reason", [
    ("ulx3s",  {"matcher_hz": 100000000, "streaming": False}, "no clock for the matcher alone"),
])
def test_clock_of_the_matcher(board, changes, reason):
    """A preset that is impossible on the board is refused, with what to omit."""
    with pytest.raises(ValueError, match=f"{reason}.*leave out"):
        soc_class(board)(replace(soc_class(board).preset, **changes))


def test_target_that_fails(monkeypatch, capsys):
    """The error is one line, with an exit status that is not zero."""
    def fail(*arguments):
        raise ToolError("what is wrong")
    monkeypatch.setattr(target, "build", fail)
    assert target.main("ulx3s", ["--build"]) == 1
    assert capsys.readouterr().err == "ulx3s: error: what is wrong\n"


def program(folder, text):
    """Write a shell script named openFPGALoader into `folder`."""
    path = folder / "openFPGALoader"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


@pytest.mark.parametrize("size", [0, 1, 4095, 4096, 4097, 5120, 100000])
def test_images_inside_the_bitstream_are_refused(tmp_path, monkeypatch, size):
    """By one line, and before anything is written; the images begin at 4096."""
    monkeypatch.setattr(loader, "build_directory", lambda: tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    calls  = tmp_path / "calls"
    folder = tmp_path / "colorlight_i5"
    folder.mkdir()
    (folder / "report.json").write_text(json.dumps(built("colorlight_i5")))
    (folder / "colorlight_i5.bit").write_bytes(bytes(size))
    program(tmp_path, f'echo "$@" >>{calls}')
    if size <= 4096:
        loader.flash("colorlight_i5")
        assert len(calls.read_text().splitlines()) == 3
    else:
        complaint = (f"colorlight_i5.bit has {size} bytes, but the firmware's images begin at 4096: set a larger "
                     "flash_offset for the board")
        with pytest.raises(ToolError, match=f"^{re.escape(complaint)}$"):
            loader.flash("colorlight_i5")
        assert not calls.exists()


def drawn_sizes(rng, limit):
    """Return sizes at a limit and away from it, on both sides; whether each fits."""
    sizes = [0, limit - 1, limit, limit + 1, rng.randrange(limit), limit + 2 + rng.randrange(limit)]
    return [(size, size <= limit) for size in sizes]


def sparse_file(path, size):
    """Write a file of that size that needs no space."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        file.truncate(size)


@pytest.mark.parametrize("board", OPEN_BOARDS)
def test_a_bitstream_that_reaches_the_images_is_not_delivered(board, tmp_path, monkeypatch, capsys):
    """Nothing is copied for it, and the check names one that is there; the offset is that of the board's SoC."""
    monkeypatch.setattr(bitstream, "build_directory", lambda: tmp_path)
    monkeypatch.setattr(bitstream, "tool_version", lambda name: name)
    monkeypatch.setattr(check, "build_directory", lambda: tmp_path)
    monkeypatch.setattr(check, "placement_key", lambda made: "key")
    monkeypatch.setattr(check, "sources", lambda name: None)
    monkeypatch.setattr("sys.argv", ["check", board])
    offset, out = soc_class(board).flash_offset, tmp_path / board
    made = sources.Sources(tmp_path / "sources", tmp_path / "boot.bin", tmp_path / "firmware.bin")
    made.folder.mkdir()
    (made.folder / "board.json").write_text(json.dumps({**built(board), "flash": {"offset": offset}}))
    made.firmware.write_bytes(b"firmware")
    placed = bitstream.Bitstream(tmp_path / "placed", made, "key")
    for size, fits in drawn_sizes(byte_generator(821, OPEN_BOARDS.index(board)), offset):
        shutil.rmtree(out, ignore_errors=True)
        sparse_file(placed.folder / "top.bit", size)
        (placed.folder / "report.json").write_text(json.dumps(built(board)["report"]))
        complaint = (f"{board}.bit has {size} bytes, but the firmware's images begin at {offset}: set a larger "
                     "flash_offset for the board")
        if fits:
            assert bitstream.deliver(placed) == out
            assert (out / f"{board}.bit").stat().st_size == size
        else:
            with pytest.raises(ToolError, match=f"^{re.escape(complaint)}$"):
                bitstream.deliver(placed)
            assert not out.exists()
            # As a build before this check left it.
            sparse_file(out / f"{board}.bit", size)
            (out / "report.json").write_text(json.dumps({**built(board), "flash": {"offset": offset}}))
        assert check.main() == (0 if fits else 1)
        said = capsys.readouterr()
        assert said.err == ("" if fits else f"boards: error: {complaint}\n")
        assert ("ends before the firmware" in said.out) == fits


@pytest.mark.parametrize("board", VENDOR_TOOLS)
def test_bitstreams_of_vendors_tools_end_before_the_images(board, monkeypatch):
    """By the sizes of the configuration guides, at the offsets of the boards."""
    size = -(-flash_room.VENDOR_BITS[board]//8)
    assert 500000 < size <= soc_class(board).flash_offset
    flash_room.check_vendor_room(board)
    for offset, fits in [(size - 1, False), (size, True), (size + 1, True)]:
        monkeypatch.setattr(soc_class(board), "flash_offset", offset)
        if fits:
            flash_room.check_vendor_room(board)
        else:
            with pytest.raises(ToolError, match=f"bitstream of the {board} has {size} bytes.* begin at {offset}: set"):
                flash_room.check_vendor_room(board)


def test_a_vendors_bitstream_that_does_not_fit_is_not_prepared(tmp_path, monkeypatch):
    """Before anything is copied."""
    monkeypatch.setattr(vendor, "build_directory", lambda: tmp_path)
    monkeypatch.setattr(soc_class("atlys"), "flash_offset", 65536)
    made = sources.Sources(tmp_path / "sources", tmp_path / "boot.bin", tmp_path / "firmware.bin")
    made.folder.mkdir()
    (made.folder / "board.json").write_text(json.dumps({"board": "atlys"}))
    with pytest.raises(ToolError, match="bitstream of the atlys has 1492412 bytes"):
        vendor.deliver(made, Resources(1, 1, 1, 1, 1))
    assert not (tmp_path / "atlys").exists()


@pytest.mark.parametrize("number", range(6))
def test_bitstreams_in_text(tmp_path, number):
    """Gowin's file has a character per bit, and comments; its size in flash is an eighth, and is what counts."""
    rng  = byte_generator(822, number)
    size = rng.randrange(1, 3000)
    bits = "".join(rng.choices("01", k=8*size))
    rows, row = [f"//Part Number: GW2A-LV18PG256C8/I7, {rng.random()}"], 0
    while row < len(bits):
        length = 8*rng.randrange(1, 80)
        rows.append(bits[row:row + length])
        row += length
    path = tmp_path / "project.fs"
    path.write_text(rng.choice(["\n", "\r\n"]).join(rows))
    assert flash_room.flash_bytes(path) == size
    flash_room.check_room(path, size)
    with pytest.raises(ToolError, match=f"project.fs has {size} bytes"):
        flash_room.check_room(path, size - 1)


def test_flash(tmp_path, monkeypatch):
    """The bitstream goes to the start of the flash, each image to its place, on the named board."""
    monkeypatch.setattr(loader, "build_directory", lambda: tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    calls = tmp_path / "calls"
    with pytest.raises(ToolError, match="is not built"):
        loader.flash("colorlight_i5")
    folder = tmp_path / "colorlight_i5"
    folder.mkdir()
    (folder / "report.json").write_text(json.dumps(built("colorlight_i5")))
    with pytest.raises(ToolError, match="not installed: run .ci/install fpga"):
        loader.flash("colorlight_i5")
    program(tmp_path, f'echo "$@" >>{calls}')
    loader.flash("colorlight_i5")
    assert calls.read_text().splitlines() == [
        f"--board colorlight-i5 --write-flash {folder}/colorlight_i5.bit",
        f"--board colorlight-i5 --write-flash --offset 4096 {folder}/firmware.bin",
        f"--board colorlight-i5 --write-flash --offset 5120 {folder}/firmware.bin"]
    program(tmp_path, "exit 1")
    with pytest.raises(ToolError, match="is it connected"):
        loader.load("colorlight_i5")


def test_loader_without_the_board():
    """A board that openFPGALoader does not know is refused before the loader is called."""
    with pytest.raises(ToolError, match="does not know the atlys: docs/boards/atlys.md"):
        loader.run_loader("atlys")


def test_check_of_a_vendors_board(monkeypatch, capsys):
    """The check names the vendor's tool, which checks the clocks."""
    monkeypatch.setattr("sys.argv", ["check", "arty"])
    assert check.main() == 1
    assert "arty: its bitstream is made, and checked, by Vivado" in capsys.readouterr().err


@pytest.mark.skipif(shutil.which("openFPGALoader") is None, reason="needs openFPGALoader: .ci/install fpga")
@pytest.mark.parametrize("board", OPEN_BOARDS)
def test_no_board(board, tmp_path, monkeypatch, capfd):
    """The real openFPGALoader knows the board's name and its probe: it fails only for lack of a device."""
    monkeypatch.setattr(loader, "build_directory", lambda: tmp_path)
    (tmp_path / board).mkdir()
    (tmp_path / board / "report.json").write_text(json.dumps(built(board)))
    (tmp_path / board / f"{board}.bit").write_bytes(bytes(1000))
    assert target.main(board, ["--load"]) == 1
    said = capfd.readouterr()
    assert f"{board}: error: openFPGALoader did not reach the {board}: is it connected" in said.err
    assert re.search("No device found|device not found", said.out + said.err)
