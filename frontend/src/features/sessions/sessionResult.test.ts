import { describe, expect, it } from "vitest";
import type { Run, Session } from "../../lib/api/client";
import { longestEndRange, total, verdictOf, widestRange, worstError, worstMotor } from "./sessionResult";
import { readSessionView } from "./sessionTabs";

type Motion = NonNullable<Run["comparison"]>["motions"][number];

const run = (of: Partial<Run>, peaks: number[] = [], motions: Partial<Motion>[] = []) =>
  ({
    outcome: "completed",
    partial: false,
    comparison: peaks.length
      ? { motors: peaks.map((peak_deg, n) => ({ motor: n + 1, peak_deg })), motions }
      : null,
    ...of,
  }) as unknown as Run;
const session = (runs: Run[], of: Partial<Session> = {}) =>
  ({ runs, ended_at: "2026-11-25T10:00:00Z", end_reason: "completed", ...of }) as Session;

describe("the verdict", () => {
  it.each([
    [session([run({})]), "completed"],
    [session([]), "none"],
    [session([run({ outcome: "unloaded" })]), "none"],
    [session([run({}), run({ outcome: "returned" })]), "shortened"],
    [session([run({})], { end_reason: "patient_request" }), "shortened"],
    [session([run({})], { ended_at: null, end_reason: null }), "open"],
    // A stop decides the verdict, even if the session is still open and everything else went well.
    [session([run({ outcome: "stopped" }), run({})], { ended_at: null }), "stopped"],
    [session([run({ outcome: "interrupted" })]), "interrupted"],
  ] as const)("of %# is %s", (given, verdict) => expect(verdictOf(given)).toBe(verdict));
});

describe("the largest error", () => {
  it("is the largest by magnitude, with its motor and playback", () => {
    expect(worstError([run({}, [0.5, -1.5]), run({}, [1.2, 0.1])])).toEqual({
      runIndex: 0,
      motor: 2,
      peak_deg: -1.5,
    });
  });

  it("leaves out partial comparisons, as the progress does", () => {
    expect(worstError([run({ partial: true }, [9]), run({}, [0.4])])?.peak_deg).toBe(0.4);
    expect(worstError([run({ partial: true }, [9])])).toBeNull();
    expect(worstMotor(run({ partial: true }, [1, 9]))).toBe(2);
  });
});

it("the widest range joins the playbacks of a motion", () => {
  const abduction = { motion: 4, taught_min_deg: 0, taught_max_deg: 80 };
  const flexion = { motion: 5, taught_min_deg: 0, taught_max_deg: 60, played_min_deg: 0, played_max_deg: 60 };
  const found = widestRange(
    session([
      run({}, [1], [{ ...abduction, played_min_deg: 10, played_max_deg: 50 }, flexion]),
      run({}, [1], [{ ...abduction, played_min_deg: 5, played_max_deg: 78 }]),
    ]),
  );
  expect(found?.motion.motion).toBe(4);
  expect(found?.reached).toEqual([5, 78]);
  expect(found?.requested).toEqual([0, 80]);
  expect(found?.patient).toBeNull();
  expect(widestRange(session([run({})]))).toBeNull();
});

it("end-range times of a motion add up, and the longest is shown", () => {
  const counted = { end_range_band_deg: 10, end_range_torque_nm: 0.5 };
  const found = longestEndRange(
    session([
      run(
        {},
        [1],
        [
          { motion: 4, end_range_s: 20.7, ...counted },
          { motion: 6, end_range_s: 25, ...counted },
        ],
      ),
      run(
        {},
        [1],
        [
          { motion: 4, end_range_s: 12.5, ...counted },
          { motion: 2, end_range_s: null },
        ],
      ),
    ]),
  );
  expect(found).toMatchObject({ total_s: 33.2, band_deg: 10, torque_nm: 0.5, motion: { motion: 4 } });
  expect(longestEndRange(session([run({}, [1], [{ motion: 4, end_range_s: null }])]))).toBeNull();
});

it("end-range times with different limits do not add up", () => {
  const one = (end_range_band_deg: number, end_range_s: number) =>
    run({}, [1], [{ motion: 4, end_range_s, end_range_band_deg, end_range_torque_nm: 0.5 }]);
  const found = longestEndRange(session([one(10, 20), one(5, 30), one(10, 4)]));
  expect(found).toMatchObject({ total_s: 30, band_deg: 5 });
});

it("a count that no playback has is not zero", () => {
  expect(total([run({ reversals: null })], ({ reversals }) => reversals)).toBeNull();
  expect(total([run({ reversals: null }), run({ reversals: 2 })], ({ reversals }) => reversals)).toBe(2);
});

it.each([
  [
    { tab: "record", run: 2 },
    { tab: "record", run: 2 },
  ],
  [{ tab: "playback" }, {}],
  [{ tab: "nonsense", run: "2" }, {}],
  [{ run: 0 }, {}],
  [{ run: 1.5 }, {}],
])("an address with %j shows %j", (search, view) => expect(readSessionView(search)).toEqual(view));

const estimated = {
  patient_min_deg: 4.2,
  patient_min_uncertainty_deg: 13.4,
  patient_max_deg: -0.2,
  patient_max_uncertainty_deg: 12.4,
};

it("each end of the patient's angle is that of the playback whose apparatus angle is shown", () => {
  const motion = { motion: 4, taught_min_deg: 0, taught_max_deg: 80 };
  const higher = run(
    {},
    [1],
    [{ ...motion, ...estimated, patient_max_deg: 71.6, played_min_deg: 10, played_max_deg: 78 }],
  );
  const lower = run(
    {},
    [1],
    [{ ...motion, ...estimated, patient_min_deg: -6.4, played_min_deg: 0, played_max_deg: 50 }],
  );
  for (const runs of [
    [higher, lower],
    [lower, higher],
  ]) {
    const found = widestRange(session(runs));
    expect(found?.reached).toEqual([0, 78]);
    expect(found?.patient).toBe("−6° ± 13° to 72° ± 12°");
  }
});

it("the patient's angle is unknown if it is unknown at one end", () => {
  const motion = { motion: 4, taught_min_deg: 0, taught_max_deg: 80 };
  const found = widestRange(
    session([
      run({}, [1], [{ ...motion, ...estimated, played_min_deg: 10, played_max_deg: 78 }]),
      run({}, [1], [{ ...motion, played_min_deg: 0, played_max_deg: 50 }]),
    ]),
  );
  expect(found?.patient).toBeNull();
});

it("a recording of the other shoulder does not describe the treated one", () => {
  const motion = {
    motion: 4,
    played_min_deg: 0,
    end_range_s: 9,
    end_range_band_deg: 10,
    end_range_torque_nm: 0.5,
  };
  const treated = run({ side: "left" }, [1], [{ ...motion, played_max_deg: 60 }]);
  const other = run({ side: "right" }, [1], [{ ...motion, played_max_deg: 150 }]);
  const both = session([other, treated], { side: "left" });
  expect(widestRange(both)?.reached).toEqual([0, 60]);
  expect(longestEndRange(both)?.total_s).toBe(9);
  expect(widestRange(session([other], { side: "left" }))).toBeNull();
});
