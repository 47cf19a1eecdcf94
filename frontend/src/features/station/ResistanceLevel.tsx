import { ActionIcon, Group, Slider, Stack, Text } from "@mantine/core";
import { IconMinus, IconPlus } from "@tabler/icons-react";
import { useId } from "react";
import type { Run } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useNewestSession } from "../../lib/patientQueries";
import { RESISTANCE_LEVELS } from "./resistanceLevels";

const MARKS = [1, 5, 10, 15, 20, RESISTANCE_LEVELS];

/** Return the level of the newest run that has a level. */
export function lastLevel(runs: Pick<Run, "resistance_level">[]): number | null {
  return runs.findLast((run) => run.resistance_level !== null)?.resistance_level ?? null;
}

/** Query the runs of the patient's newest session. They are the defaults for the next run. */
export const useLastRuns = (patientId: string) => useNewestSession(patientId, (newest) => newest?.runs ?? []);

/** Sets the resistance at which the arm is taken back, by finger, mouse or arrow keys. */
export function ResistanceLevel(props: {
  value: number | null;
  last: number | null;
  /** The highest level that the doctor allows; null without a limit. */
  highest: number | null;
  onChange: (level: number) => void;
}) {
  const { value, onChange } = props;
  const label = useId();
  const highest = props.highest ?? RESISTANCE_LEVELS;
  const marks = [...MARKS.filter((mark) => mark < highest), highest];
  const step = (by: number) => onChange(Math.min(highest, Math.max(1, (value ?? 0) + by)));
  return (
    <Stack gap={4} role="group" aria-labelledby={label}>
      <LevelHeader id={label} value={value} last={props.last} />
      <Group wrap="nowrap" gap="md" mb={20}>
        <ActionIcon
          size={44}
          variant="default"
          aria-label={t("station:level.lower")}
          disabled={value === null || value <= 1}
          onClick={() => step(-1)}
        >
          <IconMinus size={22} />
        </ActionIcon>
        <Slider
          flex={1}
          min={1}
          max={highest}
          value={value ?? 1}
          onChange={onChange}
          marks={marks.map((mark) => ({ value: mark, label: mark }))}
          label={null}
          size={22}
          thumbSize={44}
          thumbLabel={t("station:level.label")}
          styles={{ mark: { visibility: "hidden" }, markLabel: { textAlign: "center", color: "inherit" } }}
        />
        <ActionIcon
          size={44}
          variant="default"
          aria-label={t("station:level.higher")}
          disabled={value !== null && value >= highest}
          onClick={() => step(1)}
        >
          <IconPlus size={22} />
        </ActionIcon>
      </Group>
      {props.highest !== null && (
        <Text size="sm">{t("station:level.maximum", { highest: props.highest })}</Text>
      )}
      <Text size="sm">{t("station:level.explanation", { most: RESISTANCE_LEVELS })}</Text>
    </Stack>
  );
}

function LevelHeader({ id, value, last }: { id: string; value: number | null; last: number | null }) {
  return (
    <Group justify="space-between" align="baseline">
      <Text size="lg" fw={600} id={id}>
        {t("station:level.label")}
      </Text>
      <Text size="lg" fw={700} data-testid="level">
        {value === null
          ? t("station:level.choose")
          : t("station:level.value", { level: value, most: RESISTANCE_LEVELS })}
        {value !== null && value === last && (
          <Text span size="sm" fw={400}>
            {t("station:level.asLast")}
          </Text>
        )}
      </Text>
    </Group>
  );
}
