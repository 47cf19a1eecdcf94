import { beforeEach, describe, expect, it } from "vitest";
import { anglesAt, Ghost, type GhostClock, type Motion } from "./ghost";
import { limitsOf, limitsReached, rangeViolations } from "./limits";

const motion: Motion = {
  times_s: [0, 1, 3],
  angles_deg: [
    [0, 100, 0, 0, 0],
    [10, 100, 40, 0, 0],
    [10, 110, 130, 0, -90],
  ],
};

/** A clock that the test advances. */
class Stepped implements GhostClock {
  at_s = 50;
  #ticks = new Set<() => void>();
  now_s = () => this.at_s;
  every = (tick: () => void) => {
    this.#ticks.add(tick);
    return () => void this.#ticks.delete(tick);
  };
  pass(seconds: number) {
    this.at_s += seconds;
    for (const tick of [...this.#ticks]) tick();
  }
  get running() {
    return this.#ticks.size > 0;
  }
}

let clock: Stepped;
let ghost: Ghost;
beforeEach(() => {
  clock = new Stepped();
  ghost = new Ghost(motion, clock);
});

describe("a motion", () => {
  it("is interpolated linearly between samples", () => {
    expect(anglesAt(motion, 0.5)).toEqual([5, 100, 20, 0, 0]);
    expect(anglesAt(motion, 2)).toEqual([10, 105, 85, 0, -45]);
  });

  it("is constant before its start and after its end", () => {
    expect(anglesAt(motion, -1)).toEqual(motion.angles_deg[0]);
    expect(anglesAt(motion, 99)).toEqual(motion.angles_deg[2]);
  });
});

describe("the ghost", () => {
  it("waits at the beginning until it is played", () => {
    clock.pass(2);
    expect(ghost.at_s()).toBe(0);
    expect(ghost.playing).toBe(false);
  });

  it("takes as long as the recording takes", () => {
    ghost.play();
    clock.pass(2);
    expect(ghost.at_s()).toBeCloseTo(2);
    expect(ghost.get()).toEqual([10, 105, 85, 0, -45]);
    clock.pass(1.5);
    expect(ghost.at_s()).toBe(3);
    expect(ghost.playing).toBe(false);
    expect(clock.running).toBe(false);
  });

  it("stays where it is paused and continues from there", () => {
    ghost.play();
    clock.pass(1);
    ghost.pause();
    clock.pass(10);
    expect(ghost.at_s()).toBeCloseTo(1);
    ghost.play();
    clock.pass(0.5);
    expect(ghost.at_s()).toBeCloseTo(1.5);
  });

  it("continues from a new position while playing", () => {
    ghost.play();
    clock.pass(0.2);
    ghost.seek(2);
    clock.pass(0.5);
    expect(ghost.at_s()).toBeCloseTo(2.5);
    ghost.seek(99);
    expect(ghost.at_s()).toBe(3);
  });

  it("restarts when played at its end", () => {
    ghost.seek(3);
    ghost.play();
    clock.pass(0.25);
    expect(ghost.at_s()).toBeCloseTo(0.25);
  });

  it("notifies listeners until they unsubscribe", () => {
    let notified = 0;
    const leave = ghost.subscribe(() => {
      notified += 1;
    });
    ghost.play();
    clock.pass(0.1);
    expect(notified).toBe(2);
    leave();
    clock.pass(0.1);
    expect(notified).toBe(2);
  });
});

describe("the limits", () => {
  const limits = limitsOf(
    [
      [-19, 43],
      [88, 129],
      [0, 120],
      [-20, 190],
      [-90, 40],
    ].map(([min_deg, max_deg], axis) => ({
      motor: axis + 1,
      min_deg: min_deg as number,
      max_deg: max_deg as number,
      max_speed_deg_s: 100,
    })),
  );

  it("are reached a few degrees early", () => {
    expect(limitsReached([-17, 100, 118, 30, 41], limits)).toEqual(["lower", null, "upper", null, "upper"]);
  });

  it("reports violations with motor and time", () => {
    expect(rangeViolations(motion, limits)).toEqual([{ motor: 3, at_s: 3, angle_deg: 130 }]);
    expect(
      rangeViolations({ ...motion, angles_deg: motion.angles_deg.map((row) => row.with(2, 120.4)) }, limits),
    ).toEqual([]);
  });
});
