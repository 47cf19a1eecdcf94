import { ActionIcon, Group, NumberInput, Stack, Text } from "@mantine/core";
import { IconMinus, IconPlus } from "@tabler/icons-react";
import { useId } from "react";
import { PLAYING } from "./playWords";

/** What a number is called, and its bounds. */
export type Steps = { label: string; unit: string; min: number; max: number; step: number };

/** A number that is changed by finger, in steps, or typed. */
export function Stepper(props: {
  field: Steps;
  value: number;
  disabled?: boolean;
  onChange: (value: number) => void;
}) {
  const { value, disabled = false, onChange } = props;
  const { label, unit, min, max, step } = props.field;
  const id = useId();
  const give = (given: number) => onChange(Math.min(max, Math.max(min, given)));
  return (
    <Stack gap={4} role="group" aria-labelledby={id}>
      <Text size="lg" fw={600} id={id}>
        {label}
      </Text>
      <Group wrap="nowrap" gap="xs">
        <ActionIcon
          size={44}
          variant="default"
          aria-label={PLAYING.less(label)}
          disabled={disabled || value <= min}
          onClick={() => give(value - step)}
        >
          <IconMinus size={22} />
        </ActionIcon>
        <NumberInput
          size="lg"
          flex={1}
          hideControls
          aria-label={label}
          min={min}
          max={max}
          step={step}
          allowDecimal={!Number.isInteger(step)}
          suffix={unit ? ` ${unit}` : ""}
          disabled={disabled}
          value={value}
          onChange={(given) => typeof given === "number" && given >= min && given <= max && onChange(given)}
          styles={{ input: { textAlign: "center" } }}
        />
        <ActionIcon
          size={44}
          variant="default"
          aria-label={PLAYING.more(label)}
          disabled={disabled || value >= max}
          onClick={() => give(value + step)}
        >
          <IconPlus size={22} />
        </ActionIcon>
      </Group>
    </Stack>
  );
}
