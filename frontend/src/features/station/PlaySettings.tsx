import { SegmentedControl, SimpleGrid, Stack, Text } from "@mantine/core";
import { t } from "../../lib/i18n";
import { isWithin, Stepper, type Steps } from "../../ui/Stepper";
import { describeSettings, type Settings } from "./playSettingsModel";

type Field = Steps & { name: Exclude<keyof Settings, "method"> };

/** The fields, in the order of how often they are changed. The bounds are the service's. */
const FIELDS: Field[] = [
  {
    name: "speed_percent",
    label: t("station:settings.speed"),
    unit: t("station:settings.percent"),
    min: 10,
    max: 150,
    step: 10,
  },
  {
    name: "range_percent",
    label: t("station:settings.range"),
    unit: t("station:settings.percent"),
    min: 10,
    max: 100,
    step: 5,
  },
  { name: "repetitions", label: t("station:settings.repetitions"), unit: "", min: 1, max: 200, step: 1 },
  {
    name: "pause_s",
    label: t("station:settings.pause"),
    unit: t("station:settings.seconds"),
    min: 0,
    max: 120,
    step: 1,
  },
];

const METHODS: { value: Settings["method"]; label: string; what: string }[] = [
  { value: "smooth", label: t("station:settings.smooth"), what: t("station:settings.smoothExplanation") },
  {
    value: "learned",
    label: t("station:settings.learned"),
    what: t("station:settings.learnedExplanation"),
  },
  {
    value: "paper",
    label: t("station:settings.paper"),
    what: t("station:settings.paperExplanation"),
  },
];

/** Return true if all numbers that apply are within their bounds. */
export const arePlayable = (settings: Settings): boolean =>
  FIELDS.every(
    (field) =>
      (field.name === "pause_s" && settings.repetitions === 1) || isWithin(field, settings[field.name]),
  );

/** Speed, range, repetitions, pause and method of the next playback. */
export function PlaySettings(props: {
  value: Settings;
  last: Settings | null;
  onChange: (value: Settings) => void;
}) {
  const { value, last, onChange } = props;
  const asLast =
    last !== null && value.method === last.method && FIELDS.every(({ name }) => value[name] === last[name]);
  const words = arePlayable(value) ? (describeSettings(value) ?? t("station:settings.asTaught")) : null;
  return (
    <Stack gap="xs">
      <SimpleGrid cols={{ base: 1, sm: 2 }}>
        {FIELDS.map((field) => (
          <Stepper
            key={field.name}
            field={field}
            value={value[field.name]}
            disabled={field.name === "pause_s" && value.repetitions === 1}
            onChange={(given) => onChange({ ...value, [field.name]: given })}
          />
        ))}
      </SimpleGrid>
      <SegmentedControl
        fullWidth
        size="lg"
        aria-label={t("station:settings.method")}
        data={METHODS.map(({ value, label }) => ({ value, label }))}
        value={value.method}
        onChange={(method) => onChange({ ...value, method })}
      />
      <Text size="sm">{METHODS.find((method) => method.value === value.method)?.what}</Text>
      <Text size="sm" data-testid="settings">
        {words !== null &&
          (asLast
            ? t("station:settings.summaryAsLast", { settings: words })
            : t("station:settings.summary", { settings: words }))}
      </Text>
    </Stack>
  );
}
