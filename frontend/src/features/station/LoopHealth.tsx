import { Text } from "@mantine/core";
import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useAlive, useLive } from "../../lib/live/hooks";

/** Return the timing of the control loop in one line. */
export function describeLoop(loop: Schemas["LoopLive"]): string {
  return [
    t("station:loop.summary", {
      hz: loop.cycle_hz,
      missed:
        loop.overruns === 0
          ? t("station:loop.noneMissed")
          : t("station:loop.missed", { count: loop.overruns }),
    }),
    t("station:loop.latency", { ms: loop.lateness_p999_ms.toFixed(2) }),
    loop.real_time ? t("station:loop.realTime") : t("station:loop.noRealTime"),
    loop.memory_locked ? t("station:loop.locked") : t("station:loop.notLocked"),
  ].join(" · ");
}

/** Shows diagnostics for the technician. */
export function LoopHealth() {
  const alive = useAlive();
  const loop = useLive("loop");
  if (!alive || !loop) return null;
  return (
    <Text size="xs" c="dimmed" data-testid="loop">
      {describeLoop(loop)}
    </Text>
  );
}
