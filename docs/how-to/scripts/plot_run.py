"""Plot taught and played angles of a run: plot_run.py URL TOKEN_FILE RUN_ID OUT.html."""

import sys
from pathlib import Path
from uuid import UUID

from plotly.graph_objects import Figure

from kata.client import Kata


def main(url: str, token_file: str, run_id: str, out: str) -> None:
    """Write a page with one plot of all motors."""
    with Kata(url, Path(token_file).read_text().strip()) as kata:
        run, samples = kata.run(UUID(run_id)), kata.run_samples(UUID(run_id))
    figure = Figure()
    for motor in range(1, 6):
        for kind in ("setpoint", "measured"):
            figure.add_scatter(
                x=samples["time_s"], y=samples[f"motor_{motor}_{kind}_deg"], name=f"motor {motor}, {kind}"
            )
    # The samples of a simulated apparatus have this column.
    marked = " (simulated apparatus)" if "simulated" in samples else ""
    figure.update_layout(
        title=f"{run.recording_name}, {run.started_at:%Y-%m-%d %H:%M} UTC{marked}",
        xaxis_title="time, s",
        yaxis_title="angle, degrees",
    )
    figure.write_html(out)


if __name__ == "__main__":
    main(*sys.argv[1:])
