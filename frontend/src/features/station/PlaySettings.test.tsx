import { MantineProvider } from "@mantine/core";
import { cleanup, fireEvent, render, screen } from "@testing-library/react";
import { useState } from "react";
import { afterEach, describe, expect, it, vi } from "vitest";
import { arePlayable, PlaySettings } from "./PlaySettings";
import { AS_TAUGHT, describeSettings, lastSettings, type Settings } from "./playSettingsModel";

afterEach(cleanup);

function show(value: Settings, last: Settings | null = null) {
  const onChange = vi.fn();
  render(
    <MantineProvider>
      <PlaySettings value={value} last={last} onChange={onChange} />
    </MantineProvider>,
  );
  return onChange;
}

const press = (name: string) => fireEvent.click(screen.getByRole("button", { name }));

describe("playback settings", () => {
  it("change one value at a time in steps", () => {
    const onChange = show({ ...AS_TAUGHT, repetitions: 3 });
    press("Speed: decrease");
    press("Range: decrease");
    press("Repetitions: increase");
    press("Pause at each end: increase");
    const base = { ...AS_TAUGHT, repetitions: 3 };
    expect(onChange.mock.calls).toEqual([
      [{ ...base, speed_percent: 90 }],
      [{ ...base, range_percent: 95 }],
      [{ ...base, repetitions: 4 }],
      [{ ...base, pause_s: 1 }],
    ]);
  });

  it("stay within the service's limits", () => {
    const onChange = show({ ...AS_TAUGHT, speed_percent: 145, repetitions: 2 });
    press("Speed: increase");
    expect(onChange).toHaveBeenCalledWith(expect.objectContaining({ speed_percent: 150 }));
    for (const name of ["Range: increase", "Pause at each end: decrease"]) {
      expect(screen.getByRole("button", { name }).hasAttribute("disabled")).toBe(true);
    }
  });

  it.each(["35", "9", "10", "150", "151", "200", "0", "-5", "", "abc", "1e3", "20."])(
    "use exactly the shown value of %j, or refuse it",
    (typed) => {
      function Held() {
        const [value, setValue] = useState(AS_TAUGHT);
        return (
          <>
            <PlaySettings value={value} last={null} onChange={setValue} />
            <output>{arePlayable(value) ? `${value.speed_percent} %` : "refused"}</output>
          </>
        );
      }
      render(
        <MantineProvider>
          <Held />
        </MantineProvider>,
      );
      const speed = screen.getByRole("textbox", { name: "Speed" }) as HTMLInputElement;
      fireEvent.change(speed, { target: { value: typed } });
      fireEvent.blur(speed);
      const used = screen.getByRole("status", { name: "" }).textContent;
      if (used === "refused")
        expect(screen.getByRole("alert").textContent).toContain("10\u00a0to\u00a0150\u00a0%");
      else expect(speed.value).toBe(used);
    },
  );

  it("have no pause without repetitions", () => {
    show(AS_TAUGHT);
    expect(screen.getByRole("textbox", { name: "Pause at each end" }).hasAttribute("disabled")).toBe(true);
  });

  it("are described and compared with the last run", () => {
    const value = { ...AS_TAUGHT, speed_percent: 50, range_percent: 80, repetitions: 10, pause_s: 2 };
    show(value, value);
    expect(screen.getByTestId("settings").textContent).toContain(
      "80\u00a0% of the range, 50\u00a0% of the speed, 10 repetitions, pause of 2\u00a0s at each end, as last time.",
    );
    expect(describeSettings(AS_TAUGHT)).toBeNull();
    expect(describeSettings({ ...AS_TAUGHT, pause_s: 5 })).toBeNull();
  });
});

describe("the method", () => {
  it("is chosen and described", () => {
    const onChange = show(AS_TAUGHT);
    fireEvent.click(screen.getByRole("radio", { name: "Learned" }));
    expect(onChange).toHaveBeenCalledWith({ ...AS_TAUGHT, method: "learned" });
    expect(describeSettings({ ...AS_TAUGHT, method: "learned" })).toBe("learned from earlier playbacks");
    expect(describeSettings({ ...AS_TAUGHT, method: "paper" })).toBe("as in the paper, at 10\u00a0Hz");
    expect(describeSettings({ ...AS_TAUGHT, method: null })).toBeNull();
  });

  it("is smooth for runs from before methods existed", () => {
    expect(lastSettings([{ ...AS_TAUGHT, method: null, recording_id: "a" }], "a")?.method).toBe("smooth");
  });
});

describe("the last settings", () => {
  const run = (recording_id: string, speed_percent: number) => ({
    ...AS_TAUGHT,
    recording_id,
    speed_percent,
  });

  it("are those of the same recording's newest run", () => {
    const runs = [run("a", 50), run("a", 60), run("b", 70)];
    expect(lastSettings(runs, "a")).toEqual({ ...AS_TAUGHT, speed_percent: 60 });
    expect(lastSettings(runs, "c")).toBeNull();
  });

  it("are not those of an end-feel test, whose settings are fixed", () => {
    const runs = [run("a", 50), { ...run("a", 100), end_feel: "baseline" as const }];
    expect(lastSettings(runs, "a")).toEqual({ ...AS_TAUGHT, speed_percent: 50 });
  });
});
