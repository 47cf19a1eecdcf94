import { Text } from "@mantine/core";
import type { Schemas } from "../api/client";
import { useAlive, useLive } from "../live/hooks";

/** How punctual the control loop is, in one line. */
export function loopWords(loop: Schemas["LoopLive"]): string {
  const missed = loop.overruns === 1 ? "1 cycle missed" : `${loop.overruns} cycles missed`;
  return [
    `Control loop at ${loop.cycle_hz} Hz: ${loop.overruns === 0 ? "no cycle missed" : missed}`,
    `99.9 % began within ${loop.lateness_p999_ms.toFixed(2)} ms`,
    loop.real_time ? "real time granted" : "real time not granted",
    loop.memory_locked ? "memory locked" : "memory not locked",
  ].join(" · ");
}

/** For whoever looks after the computer; a therapist need not read it. */
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
