"""Whole runs as parts of a benchmark."""

from bt_tamp.executive.loop import run_scenario
from bt_tamp.options import RunOptions
from bt_tamp.report.recorder import RunRecorder
from bt_tamp.report.result import RunResult


def whole_run(recorder: RunRecorder, options: RunOptions) -> RunResult:
    """Run the recorder's scenario. Raises KeyboardInterrupt if it was interrupted: the run ends with a result then, but
    what it was a part of must end too."""
    with recorder:
        result = run_scenario(recorder.scenario, options, recorder)
    if result.outcome == "interrupted":
        raise KeyboardInterrupt
    return result
