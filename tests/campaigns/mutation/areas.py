#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What faults are drawn from: areas, each with the narrow tests of each of its files.

A test is a file below `tests/`, with or without the name of a test, or an argument of pytest; of the firmware also a
program of `firmware/tests/Makefile`. Quick ones first: the first that fails ends the judgement.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from . import c_faults, gateware_faults, python_faults
from .mutant import Faults

PROOF      = "formal/test_formal.py::test_a_core_as_it_is_passes"
PERIPHERAL = "gateware/peripherals/test_stereo_peripheral.py"
RECTIFIED  = "gateware/peripherals/test_rectification.py"
GRIDS      = "gateware/peripherals/test_grid_registers.py"
LINK       = "gateware/peripherals/test_frame_link.py"
REGISTERS  = "gateware/peripherals/test_registers.py"
STREAMING  = "gateware/link/test_streaming.py"
NETWORK    = "gateware/link/test_network.py"
WIRE       = "gateware/link/test_wire.py"


@dataclass(frozen=True)
class Area:
    """Files that faults are drawn from.

    Files of its folders that have no entry have no faults, or are in `excluded` with the reason.
    """
    faults:   Faults
    folders:  tuple[str, ...]             #: from the checkout on
    suffixes: tuple[str, ...]
    prefix:   str                         #: of the names in `tests` and `excluded`
    tests:    dict[str, tuple[str, ...]]
    needs:    tuple[str, ...]             #: folders with what the tests are made of, other than tests
    limit_s:  int                         #: processor time that each process of a mutant's tests may take
    excluded: dict[str, str] = field(default_factory=dict)
    #: What shows that a survivor does as the file does, if it is the same: models, assembly, or nothing.
    unchanged: Literal["models", "assembly", ""] = ""


#: What the tests of gateware are made of.
MODELS = ("gateware", "sim/cores", "sim/models", "soc/build")

PIXEL_PATH = {
    "engines/costs.py":                       ("gateware/matcher/test_engine.py", "gateware/matcher/test_latency.py"),
    "engines/sad/absolute_difference.py":     ("gateware/matcher/test_pixels.py", "-k", "absolute_difference"),
    "engines/sad/block_sum.py":               ("gateware/engines/test_sums.py", "-k", "block_sum"),
    "engines/sad/column_sum.py":              ("gateware/engines/test_sums.py", "-k", "column_sum"),
    "engines/sad/sad_engine.py":              ("gateware/matcher/test_matcher.py", "-k", "smallest_image"),
    "matcher/alignment.py":                   ("gateware/matcher/test_pixels.py", "-k", "alignment"),
    "matcher/frame_settings.py":              (f"{PERIPHERAL}::test_limits_of_settings",
                                               f"{PERIPHERAL}::test_bad_settings"),
    "matcher/line_buffer.py":                 ("gateware/matcher/test_pixels.py", "-k", "line_buffer"),
    "matcher/matcher.py":                     ("gateware/matcher/test_matcher.py", "-k",
                                               "awkward or smallest or back_to_back or reset or waits"),
    "matcher/prefilter.py":                   ("gateware/matcher/test_pixels.py", "-k", "prefilter"),
    "matcher/raster.py":                      ("gateware/matcher/test_pixels.py", "-k", "raster or drawn_frame"),
    "post/border.py":                         ("gateware/post/test_map.py", "-k", "border"),
    "post/left_right/left_right.py":          ("gateware/post/test_left_right.py",),
    "post/left_right/left_right_check.py":    ("gateware/post/test_left_right.py",),
    "post/left_right/vote_row.py":            ("gateware/post/test_left_right.py",),
    "post/median.py":                         ("gateware/post/test_map.py", "-k", "median"),
    "post/selection/cost_delay.py":           ("gateware/post/test_selection.py", "-k", "cost_delay"),
    "post/selection/selection.py":            ("gateware/post/test_selection.py", "-k", "whole_selection"),
    "post/selection/subpixel.py":             ("gateware/post/test_selection.py", "-k", "subpixel or neighbours"),
    "post/selection/uniqueness.py":           ("gateware/post/test_selection.py", "-k", "uniqueness or cost_limit"),
    "post/selection/winner.py":               ("gateware/post/test_selection.py", "-k", "winner"),
}

MEMORY = {
    "line_reader.py":   ("gateware/memory/test_line_reader.py",),
    # The proof requires all marks, the peripheral does not.
    "pair_reader.py":   (f"{PROOF}[PairReader]", PERIPHERAL),
    "ports.py":         (PERIPHERAL,),
    "stream_reader.py": (f"{PROOF}[StreamReader]", f"{PROOF}[StreamReader, bus errors]", LINK),
    "stream_writer.py": (f"{PROOF}[StreamWriter]", PERIPHERAL),
}

LINK_CORES = {
    "address_table.py":   ("gateware/link/test_address_table.py", NETWORK),
    "echo.py":            ("gateware/link/test_header_parser.py", NETWORK),
    "event_counters.py":  ("gateware/link/test_event_counters.py", LINK),
    "header_parser.py":   ("gateware/link/test_header_parser.py", NETWORK),
    "header_writer.py":   ("gateware/link/test_header_writer.py", NETWORK),
    "headers.py":         ("gateware/link/test_header_writer.py", "gateware/link/test_header_parser.py"),
    "map_parts.py":       (STREAMING, f"{PROOF}[MapParts]"),
    "message_arbiter.py": (f"{PROOF}[MessageArbiter]", STREAMING),
    "message_buffer.py":  (LINK, f"{PROOF}[MessageBuffer]"),
    "message_crc.py":     ("gateware/link/test_message_crc.py", LINK),
    "message_framer.py":  (LINK, f"{PROOF}[MessageFramer]"),
    "message_sorter.py":  (LINK, STREAMING, f"{PROOF}[MessageSorter]"),
    "network.py":         (NETWORK,),
    "pair_gate.py":       (STREAMING, f"{PROOF}[PairGate]"),
    "send_queue.py":      (LINK, STREAMING, f"{PROOF}[SendQueue]"),
    "slot_table.py":      ("gateware/link/test_slot_table.py", LINK, STREAMING, f"{PROOF}[SlotTable]"),
    "wire_receiver.py":   (WIRE, NETWORK),
    "wire_sender.py":     (WIRE, NETWORK),
}

CROSSINGS = {
    "common/crossing.py":             ("gateware/common/test_crossing.py", f"{PROOF}[Crossing]",
                                       f"{PROOF}[Crossing, resets]"),
    "common/crossing_reset.py":       ("gateware/common/test_crossing.py", f"{PROOF}[Crossing, resets]"),
    "common/pulse_crossing.py":       ("gateware/common/test_crossing.py", f"{PROOF}[PulseCrossing]"),
    "common/stream_register.py":      (f"{PROOF}[add_register]", LINK),
    "memory/port_crossing.py":        ("gateware/memory/test_port_crossing.py", PERIPHERAL, "-k",
                                       "test_port_crossing or crossed or faster"),
    "peripherals/stereo_crossing.py": (PERIPHERAL, RECTIFIED, "-k", "crossed or faster"),
}

RECTIFICATION = {
    "bilinear.py":   ("gateware/rectification/test_cores.py",),
    "map_grid.py":   ("gateware/rectification/test_cores.py", "gateware/rectification/test_rectifier.py"),
    "rectifier.py":  ("gateware/rectification/test_rectifier.py",),
    "row_ring.py":   ("gateware/rectification/test_rectifier.py",),
    "row_window.py": ("gateware/rectification/test_cores.py", "gateware/rectification/test_rectifier.py"),
}

CAMERAS = {
    "clock_watch.py":       ("gateware/cameras/test_sensor_capture.py", "-k", "runs"),
    "dvp_receiver.py":      ("gateware/cameras/test_dvp_receiver.py",),
    "event_totals.py":      ("gateware/cameras/test_sensor_capture.py", "-k", "frames"),
    "frame_guard.py":       ("gateware/cameras/test_frame_guard.py", f"{PROOF}[FrameGuard]"),
    "frame_queue.py":       ("gateware/cameras/test_pair_join.py",),
    "frame_statistics.py":  ("gateware/cameras/test_frame_statistics.py",),
    "noise.py":             ("gateware/cameras/test_pattern.py",),
    "pair_join.py":         ("gateware/cameras/test_pair_join.py",),
    "pair_matcher.py":      ("gateware/cameras/test_triggers.py",),
    "pattern_source.py":    ("gateware/peripherals/test_cameras.py", "-k", "test_pattern or test_sensors"),
    "sensor_capture.py":    ("gateware/cameras/test_sensor_capture.py",),
    "sensor_crossing.py":   ("gateware/cameras/test_sensor_crossing.py", "gateware/cameras/test_sensor_capture.py"),
    "test_pattern.py":      ("gateware/cameras/test_pattern.py",),
    "trigger_generator.py": ("gateware/cameras/test_triggers.py",),
}

PERIPHERALS = {
    "cameras.py":           ("gateware/peripherals/test_cameras.py",),
    "cameras_csr.py":       (REGISTERS, "gateware/peripherals/test_cameras.py"),
    # The network's has no streamed frames.
    "frame_link.py":        (LINK, STREAMING, NETWORK),
    # The others have no registers.
    "frame_link_csr.py":    (REGISTERS,),
    "grid_port.py":         (GRIDS,),
    "rectification.py":     (RECTIFIED,),
    "stereo_csr.py":        (REGISTERS, GRIDS, f"{PROOF}[StereoPeripheral]"),
    "stereo_peripheral.py": (f"{PROOF}[StereoPeripheral]", PERIPHERAL, RECTIFIED),
}


def _gateware(tests: dict[str, tuple[str, ...]], prefix: str, *folders: str, limit_s: int = 1200,
              excluded: dict[str, str] | None = None) -> Area:
    return Area(gateware_faults.mutants_of, tuple(f"gateware/{folder}" for folder in folders), (".py",), prefix, tests,
                (*MODELS, "tests/formal", "tests/support"), limit_s, excluded or {}, "models")


_SESSION = ("test_session", "test_session_peers", "test_session_frames", "test_session_stream", "test_session_update",
            "test_serial_link", "test_udp_link")
_MATCHER = ("firmware/test_stereo_bm.py",)

FIRMWARE = {
    "drivers/dma_memory.h":              ("test_dma_memory", "test_stereo", "test_frame_link"),
    "drivers/flash.c":                   ("test_flash", "test_records", "test_update"),
    "drivers/flash_pins.h":              ("test_flash", "test_records"),
    "drivers/flash_read.c":              ("test_flash", "test_image", "test_records"),
    "drivers/frame_link.c":              ("test_frame_link", "test_frame_link_stream", "test_dma_memory",
                                           "test_udp_link"),
    "drivers/record_copy.c":             ("test_records",),
    "drivers/records.c":                 ("test_records", "test_update"),
    "drivers/rectification.c":           ("test_rectification", "test_session_calibration", "test_app_rectification"),
    "drivers/reset.c":                   ("test_reset",),
    "drivers/reset_word.h":              ("test_reset", "test_start"),
    "drivers/screen.c":                  ("test_screen",),
    "drivers/sensors/ar0134.c":          ("test_sensors", "test_sensor_exposure"),
    "drivers/sensors/mt9v034.c":         ("test_sensors", "test_sensor_exposure"),
    "drivers/sensors/ov7670.c":          ("test_sensors", "test_sensor_exposure"),
    "drivers/sensors/sensor_bus.c":      ("test_sensor_bus", "test_sensors"),
    "drivers/sensors/sensor_model.h":    ("test_sensors", "test_sensor_exposure"),
    "drivers/sensors/sensor_settings.c": ("test_sensors", "test_sensor_exposure"),
    "drivers/sensors/sensors.c":         ("test_sensors", "test_sensor_exposure"),
    "drivers/serial.c":                  ("test_serial", "test_app"),
    "drivers/serial_print.c":            ("test_print",),
    "drivers/stereo.c":                  ("test_stereo", "test_stereo_api", "test_dma_memory", "test_rectification"),
    "drivers/trial.c":                   ("test_update", "test_start"),
    "drivers/trial_choice.c":            ("test_update", "test_start"),
    "drivers/watchdog.c":                ("test_reset", "test_no_watchdog", "test_start", "test_app"),
    "lib/bytes.c":                       ("test_crc32", "test_message", "test_records"),
    "lib/bytes.h":                       ("test_message", "test_records", "test_update"),
    "lib/calibration.c":                 ("test_calibration", "test_rectification"),
    "lib/crc32.c":                       ("test_crc32", "test_message"),
    "lib/exposure.c":                    ("test_exposure", "test_sensor_exposure"),
    "lib/grey_map.c":                    ("test_grey_map", "test_map_view", "firmware/test_grey_map.py"),
    "lib/pattern.h":                     ("test_app", "firmware/test_console.py"),
    "lib/print.c":                       ("test_print",),
    "lib/row_budget.c":                  ("test_calibration", "test_rectification", "firmware/test_row_budget.py"),
    "lib/sectors.c":                     ("test_sectors",),
    "lib/stereo_settings.c":             ("test_stereo", "test_stereo_api", "test_sectors", "test_app"),
    "link/counters.h":                   ("test_session", "test_udp_link", "test_app_link"),
    "link/exchange.h":                   _SESSION,
    "link/frame_pool.c":                 ("test_frame_pool", *_SESSION),
    "link/frame_pool.h":                 ("test_frame_pool", *_SESSION),
    "link/protocol/cobs.c":              ("test_cobs",),
    "link/protocol/message.c":           ("test_message", "test_session"),
    "link/protocol/peer.h":              _SESSION,
    "link/serial_link.c":                ("test_serial_link", "test_session", "test_app_link"),
    "link/session.c":                    (*_SESSION, "test_app_link"),
    "link/session_calibration.c":        ("test_session_calibration",),
    "link/session_frames.c":             (*_SESSION, "test_app_link"),
    "link/session_peer.c":               (*_SESSION, "test_app_link"),
    "link/session_pieces.c":             (*_SESSION, "test_app_link"),
    "link/session_slots.c":              (*_SESSION, "test_app_link"),
    "link/session_stream.c":             (*_SESSION, "test_app_stream"),
    "link/session_update.c":             (*_SESSION, "test_update"),
    "link/udp/udp_link.c":               ("test_udp_link", "test_app_link", "test_app_stream"),
    "link/udp/udp_stream.c":             ("test_udp_link", "test_app_stream"),
    "link/update/calibrate.c":           ("test_session_calibration", "test_app_rectification"),
    "link/update/update.c":              ("test_update", "test_start", "test_session_update"),
    "reference/left_right.c":            ("test_app", *_MATCHER),
    "reference/median.c":                ("test_app", *_MATCHER),
    "reference/prefilter.c":             ("test_app", *_MATCHER),
    "reference/stereo_bm.c":             ("test_app", *_MATCHER),
    "reference/stereo_bm_stages.h":      ("test_app", *_MATCHER),
}

_EVAL    = tuple(f"host_tools/cli/test_cli_eval.py::test_{name}" for name in (
    "a_table_with_means", "the_table_of_a_narrow_terminal", "opencv_s_settings_are_ours", "kitti_has_d1",
    "a_device_with_one_host_at_a_time_gets_all_pairs_one_after_the_other",
    "processes_and_csv", "mistakes_are_one_line", "what_was_guessed_is_said_by_all_processes"))
_FILTERS = ("host_tools/core/test_filters.py",)
_SOURCES = ("host_tools/data/test_short_files.py", "host_tools/live/test_stream.py::test_videos",
            "host_tools/live/test_stream.py::test_mistakes",
            "host_tools/live/test_stream.py::test_folders_without_pairs")

#: Programs in C of tests in Python: the others need not be built for them.
PROGRAMS = {
    "firmware/test_console.py":                   "native_device",
    "firmware/test_grey_map.py":                  "draw_map",
    "firmware/test_row_budget.py":                "count_rows",
    "firmware/test_stereo_bm.py":                 "run_stereo_bm",
    "host_tools/cli/test_cli.py":                 "native_device",
    "host_tools/cli/test_cli_examples.py":        "native_device",
    "host_tools/protocol/test_any_bytes.py":      "decode_lines",
}

HOST = {
    "core/__init__.py":        ("host_tools/core/test_arrays.py", "host_tools/core/test_pictures.py"),
    "core/arrays.py":          ("host_tools/core/test_arrays.py",),
    "core/decimation.py":      _FILTERS,
    "core/disparity_map.py":   (*_FILTERS, "host_tools/cli/test_cli_filters.py::test_match"),
    "core/errors.py":          ("host_tools/core/test_errors.py",
                                "host_tools/cli/test_cli.py::test_wrong_usage_is_one_line_and_status_2"),
    "core/extras.py":          ("host_tools/core/test_opencv.py",
                                "host_tools/cli/test_cli_eval.py::test_a_package_that_is_not_installed"),
    "core/features.py":        ("host_tools/protocol/test_protocol.py", "host_tools/devices/test_missing_stages.py"),
    "core/filters.py":         _FILTERS,
    "core/geometry.py":        ("host_tools/core/test_geometry.py",),
    "core/grid.py":            ("host_tools/core/test_grid.py", "host_tools/cameras/test_pair_grids.py"),
    "core/hole_filling.py":    _FILTERS,
    "core/images.py":          ("host_tools/core/test_images.py", "host_tools/core/test_pictures.py"),
    "core/map_filter.py":      _FILTERS,
    "core/mcap.py":            ("host_tools/core/test_mcap.py",),
    "core/opencv.py":          ("host_tools/core/test_opencv.py",),
    "core/outputs.py":         ("host_tools/core/test_outputs.py",
                                "host_tools/cli/test_cli_outputs.py::test_an_input_is_not_replaced"),
    "core/settings.py":        ("host_tools/devices/test_stereo_bm.py",
                                "host_tools/cli/test_cli.py::test_wrong_images_are_one_line_and_status_1",
                                "host_tools/cli/test_cli.py::test_what_the_device_was_not_built_for"),
    "core/spatial.py":         _FILTERS,
    "core/speckle.py":         (*_FILTERS, "host_tools/devices/test_stereo_bm.py"),
    "core/temporal.py":        _FILTERS,
    "core/threshold.py":       _FILTERS,
    "data/consistency.py":     ("host_tools/data/test_map_files.py",),
    "data/datasets.py":        ("host_tools/data/test_datasets.py",),
    "data/ground_truth.py":    ("host_tools/core/test_images.py",),
    "data/layouts.py":         ("host_tools/data/test_layouts.py",),
    "data/map_files.py":       ("host_tools/data/test_map_files.py", "host_tools/core/test_images.py"),
    "data/recordings.py":      ("host_tools/cli/test_cli_play.py",),
    "data/regions.py":         ("host_tools/data/test_regions.py", "host_tools/data/test_layouts.py"),
    "data/samples.py":         ("host_tools/data/test_layouts.py", *_EVAL),
    "data/sources/base.py":    _SOURCES,
    "data/sources/files.py":   ("host_tools/data/test_pairing.py", "host_tools/cli/test_cli_examples.py"),
    "data/sources/opening.py": _SOURCES,
    "data/sources/pairing.py": ("host_tools/data/test_pairing.py",),
    "data/sources/recording.py": ("host_tools/cli/test_cli_play.py",),
    "data/sources/video.py":   _SOURCES,
    "evaluation/flat_target.py": ("host_tools/evaluation/test_flat_target.py",),
    "evaluation/matchers.py":  ("host_tools/evaluation/test_matchers.py", *_EVAL),
    "evaluation/metrics.py":   ("host_tools/evaluation/test_metrics.py",),
    "evaluation/parallel.py":  _EVAL,
    "evaluation/report.py":    _EVAL,
    "evaluation/work.py":      (*_EVAL, "host_tools/cli/test_cli_filters.py::test_eval"),
    "protocol/cobs.py":        ("host_tools/protocol/test_cobs.py", "host_tools/protocol/test_any_bytes.py"),
    "protocol/messages.py":    ("host_tools/protocol/test_protocol.py", "firmware/test_protocol_numbers.py",
                                "host_tools/protocol/test_any_bytes.py"),
    "protocol/payloads.py":    ("host_tools/protocol/test_protocol.py", "firmware/test_protocol_numbers.py"),
    "protocol/refusals.py":    ("host_tools/protocol/test_protocol.py",),
}

AREAS = {
    "host": Area(python_faults.mutants_of,
                 tuple(f"host_tools/{room}" for room in ("core", "data", "evaluation", "protocol")), (".py",),
                 "host_tools/", HOST, ("host_tools", "tests/support"), 120, {
        "core/features_table.py": "written by litestereo.soc.reports.tables, and compared with its source by a test",
        "core/settings_table.py": "written by litestereo.soc.reports.tables, and compared with its source by a test",
    }),
    "firmware": Area(c_faults.mutants_of,
                     tuple(f"firmware/{folder}" for folder in ("drivers", "lib", "link", "reference")), (".c", ".h"),
                     "firmware/", FIRMWARE,
                     ("firmware/drivers", "firmware/include", "firmware/lib", "firmware/link", "firmware/reference",
                      "firmware/tests/Makefile", "firmware/tests/stubs", "firmware/tests/support"), 60, {
        "drivers/ensure.c":   "ends the program: only a test that fails runs it to the end",
        "drivers/platform.c": "caches, interrupts and stack of the processor: only simulation runs it",
    }, "assembly"),
    "pixel-path": _gateware(PIXEL_PATH, "gateware/", "engines", "matcher", "post"),
    "rectification": _gateware(RECTIFICATION, "gateware/rectification/", "rectification"),
    "cameras":    _gateware(CAMERAS, "gateware/cameras/", "cameras"),
    "memory":     _gateware(MEMORY, "gateware/memory/", "memory",
                            excluded={"port_crossing.py": "in the crossings"}),
    "link":       _gateware(LINK_CORES, "gateware/link/", "link"),
    "crossings":  _gateware(CROSSINGS, "gateware/", "common", excluded={
        "common/bus_register.py": "only the SoC of a board has it, and only simulation of that SoC runs it",
        "common/pipeline.py":     "delays inside the cores of the pixel path, whose missing registers are faults",
    }),
    "peripheral": _gateware(PERIPHERALS, "gateware/peripherals/", "peripherals",
                            excluded={"stereo_crossing.py": "in the crossings"}),
}
