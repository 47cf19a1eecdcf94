import "./catalogue";
import { Group, Select, SimpleGrid, Stack, Switch, Text } from "@mantine/core";
import { t } from "../../lib/i18n";
import { HelpLink } from "../../ui/HelpLink";
import { isWithin, Stepper, type Steps } from "../../ui/Stepper";
import { SHOULDER_MOTIONS, shoulderMotionName } from "../episodes/messages";
import type { EndRangePrescription } from "./describeProgramme";

type Field = Steps & { name: "minutes" | "band_deg" | "torque_nm" };

/** The bounds are the service's. */
const FIELDS: Field[] = [
  {
    name: "minutes",
    ...t("programmes:endRange.minutes", { returnObjects: true }),
    min: 0.5,
    max: 60,
    step: 0.5,
  },
  { name: "band_deg", ...t("programmes:endRange.band", { returnObjects: true }), min: 2, max: 20, step: 1 },
  {
    name: "torque_nm",
    ...t("programmes:endRange.torque", { returnObjects: true }),
    min: 0.5,
    max: 4,
    step: 0.1,
  },
];

/** Shown when the user begins to prescribe. Band and torque are those of a playback without prescription. */
const USUAL: EndRangePrescription = { motion: 4, minutes: 5, band_deg: 10, torque_nm: 0.5 };

/** Return true if nothing is prescribed, or all numbers are within their bounds. */
export const isEndRangeValid = (value: EndRangePrescription | null): boolean =>
  value === null || FIELDS.every((field) => isWithin(field, value[field.name]));

/** Edits the prescribed end-range time of an item. `problem`: the reason why it cannot be counted. */
export function EndRangeFields(props: {
  value: EndRangePrescription | null;
  problem: string | null;
  onChange: (value: EndRangePrescription | null) => void;
}) {
  const { value, problem, onChange } = props;
  return (
    <Stack gap="xs" role="group" aria-label={t("programmes:endRange.title")}>
      <Switch
        size="lg"
        label={t("programmes:endRange.title")}
        checked={value !== null}
        onChange={(event) => onChange(event.currentTarget.checked ? USUAL : null)}
      />
      {value !== null && (
        <>
          <Group justify="space-between">
            <Text size="sm">{t("programmes:endRange.explanation")}</Text>
            <HelpLink topic="dose" subject={t("programmes:endRange.title")} />
          </Group>
          <Select
            size="lg"
            label={t("programmes:endRange.motion")}
            allowDeselect={false}
            data={SHOULDER_MOTIONS.map((motion) => ({
              value: String(motion),
              label: shoulderMotionName(motion),
            }))}
            value={String(value.motion)}
            onChange={(motion) => onChange({ ...value, motion: Number(motion) })}
          />
          <SimpleGrid cols={{ base: 1, sm: 2 }}>
            {FIELDS.map((field) => (
              <Stepper
                key={field.name}
                field={field}
                value={value[field.name]}
                onChange={(given) => onChange({ ...value, [field.name]: given })}
              />
            ))}
          </SimpleGrid>
          {problem && (
            <Text fw={600} c="grape.9" role="alert">
              {problem}
            </Text>
          )}
        </>
      )}
    </Stack>
  );
}
