import { Button, Group, Slider, Stack, Text } from "@mantine/core";
import { useReducedMotion } from "@mantine/hooks";
import { IconPlayerPause, IconPlayerPlay } from "@tabler/icons-react";
import { useEffect, useSyncExternalStore } from "react";
import { formatDeg } from "../../lib/format";
import { t } from "../../lib/i18n";
import type { Ghost } from "./ghost";
import type { RangeViolation } from "./limits";

const STEP_S = 0.05;
/** Step of the slider. It is readable and puts little load on the page. */
const SHOWN_S = 0.1;

/** Play, pause and a slider over the recording's time. This sends nothing to the apparatus. */
export function GhostPanel({
  ghost,
  violations,
  playsItself = false,
  subject = "ghost",
  marks_s = [],
}: {
  ghost: Ghost;
  violations: RangeViolation[];
  playsItself?: boolean;
  /** The motion that is being played. */
  subject?: "ghost" | "run";
  /** Times that the slider marks. */
  marks_s?: number[];
}) {
  const still = useReducedMotion();
  const playing = useSyncExternalStore(ghost.subscribe, () => ghost.playing);
  const at_s = useSyncExternalStore(ghost.subscribe, () =>
    ghost.playing ? Math.floor(ghost.at_s() / SHOWN_S) * SHOWN_S : ghost.at_s(),
  );
  useEffect(() => {
    if (playsItself && !still) ghost.play();
    return () => ghost.pause();
  }, [ghost, playsItself, still]);
  const length = ghost.duration_s;
  return (
    <Stack gap={4} my="xs" component="section" aria-label={t(`digital-twin:${subject}.title`)}>
      {/* On a telephone the slider has a row of its own. */}
      <Group gap="md">
        <Button
          variant="default"
          h={44}
          w={210}
          leftSection={playing ? <IconPlayerPause size={20} /> : <IconPlayerPlay size={20} />}
          onClick={() => (playing ? ghost.pause() : ghost.play())}
        >
          {playing ? t(`digital-twin:${subject}.pause`) : t(`digital-twin:${subject}.play`)}
        </Button>
        <Slider
          flex="1 1 12rem"
          size="lg"
          thumbSize={28}
          thumbLabel={t("digital-twin:ghost.time")}
          min={0}
          max={length}
          step={STEP_S}
          marks={marks_s.map((value) => ({ value }))}
          value={at_s}
          label={(value) => t("digital-twin:ghost.seconds", { seconds: formatDeg(value) })}
          onChange={(value) => ghost.seek(value)}
        />
        <Text
          style={{ fontVariantNumeric: "tabular-nums" }}
          miw={110}
          ta="right"
          ml="auto"
          data-testid="ghost-time"
        >
          {t("digital-twin:ghost.at", { at: formatDeg(at_s), length: formatDeg(length) })}
        </Text>
      </Group>
      {violations.map((violation) => (
        <Text key={violation.motor} fw={600}>
          {t("digital-twin:ghost.leavesRange", {
            motor: violation.motor,
            at: formatDeg(violation.at_s),
            angle: formatDeg(violation.angle_deg),
          })}
        </Text>
      ))}
    </Stack>
  );
}
