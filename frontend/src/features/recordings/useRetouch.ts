import { useState } from "react";
import type { Schemas } from "../../lib/api/client";
import { type Part, wholePart } from "./retouch";

/** The state of the editor: the part, and earlier parts to undo. `selected`: place of the selected point. */
export type RetouchState = {
  part: Part;
  motor: number;
  selected: number | null;
  canUndo: boolean;
  /** Change the part. A change without a step (during a drag) belongs to the step before. */
  change: (part: Part, step?: boolean) => void;
  select: (place: number | null) => void;
  chooseMotor: (motor: number) => void;
  undo: () => void;
};

const reach = (range: Schemas["MotorRange"]) => range.max_deg - range.min_deg;

/**
 * Holds the marks and points of a retouch until it is saved, and undoes changes one by one. It begins with the motor
 * that moves most.
 */
export function useRetouch(duration_s: number, ranges: Schemas["MotorRange"][]): RetouchState {
  const [part, setPart] = useState(() => wholePart(duration_s));
  const [past, setPast] = useState<Part[]>([]);
  const [motor, setMotor] = useState(
    () => ranges.toSorted((one, other) => reach(other) - reach(one))[0]?.motor ?? 3,
  );
  const [selected, select] = useState<number | null>(null);
  return {
    part,
    motor,
    selected,
    canUndo: past.length > 0,
    change: (next, step = true) => {
      if (step) setPast([...past, part]);
      setPart(next);
    },
    select,
    chooseMotor: (chosen) => {
      setMotor(chosen);
      const first = part.points.findIndex((point) => point.motor === chosen);
      select(first === -1 ? null : first);
    },
    undo: () => {
      const last = past.at(-1);
      if (!last) return;
      setPart(last);
      setPast(past.slice(0, -1));
      select(last.points.length > 0 ? Math.min(selected ?? 0, last.points.length - 1) : null);
    },
  };
}
