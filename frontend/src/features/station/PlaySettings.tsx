import { SegmentedControl, SimpleGrid, Stack, Text } from "@mantine/core";
import { isWithin, Stepper, type Steps } from "../../ui/Stepper";
import { PLAYING } from "./playMessages";
import { type Settings, settingsWords } from "./playSettingsModel";

type Field = Steps & { name: Exclude<keyof Settings, "method"> };

/** The most changed first. The bounds are the service's. */
const FIELDS: Field[] = [
  { name: "speed_percent", label: PLAYING.speed, unit: PLAYING.percent, min: 10, max: 150, step: 10 },
  { name: "range_percent", label: PLAYING.range, unit: PLAYING.percent, min: 10, max: 100, step: 5 },
  { name: "repetitions", label: PLAYING.repetitions, unit: "", min: 1, max: 200, step: 1 },
  { name: "pause_s", label: PLAYING.pause, unit: PLAYING.seconds, min: 0, max: 120, step: 1 },
];

const METHODS: { value: Settings["method"]; label: string; what: string }[] = [
  { value: "smooth", label: PLAYING.smooth, what: PLAYING.smoothIs },
  {
    value: "learned",
    label: PLAYING.learned,
    what: PLAYING.learnedIs,
  },
  {
    value: "paper",
    label: PLAYING.paper,
    what: PLAYING.paperIs,
  },
];

/** True if all numbers that apply are within their bounds. */
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
  const words = arePlayable(value) ? (settingsWords(value) ?? PLAYING.asTaught) : null;
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
        aria-label={PLAYING.way}
        data={METHODS.map(({ value, label }) => ({ value, label }))}
        value={value.method}
        onChange={(method) => onChange({ ...value, method })}
      />
      <Text size="sm">{METHODS.find((method) => method.value === value.method)?.what}</Text>
      <Text size="sm" data-testid="settings">
        {words !== null && (asLast ? PLAYING.toldAsLast(words) : PLAYING.told(words))}
      </Text>
    </Stack>
  );
}
