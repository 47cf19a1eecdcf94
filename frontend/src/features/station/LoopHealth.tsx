import { Text } from "@mantine/core";
import type { Schemas } from "../../lib/api/client";
import { useAlive, useLive } from "../../lib/live/hooks";
import { LOOP } from "./messages";

/** Describe the timing of the control loop in one line. */
export function loopWords(loop: Schemas["LoopLive"]): string {
  return [
    LOOP.at(loop.cycle_hz, loop.overruns === 0 ? LOOP.noneMissed : LOOP.missed(loop.overruns)),
    LOOP.within(loop.lateness_p999_ms.toFixed(2)),
    loop.real_time ? LOOP.realTime : LOOP.noRealTime,
    loop.memory_locked ? LOOP.locked : LOOP.notLocked,
  ].join(" · ");
}

/** Diagnostics for the technician. */
export function LoopHealth() {
  const alive = useAlive();
  const loop = useLive("loop");
  if (!alive || !loop) return null;
  return (
    <Text size="xs" c="dimmed" data-testid="loop">
      {loopWords(loop)}
    </Text>
  );
}
