import { ActionIcon, Group, NumberInput, Stack, Text } from "@mantine/core";
import { IconMinus, IconPlus } from "@tabler/icons-react";
import { useId } from "react";
import { PLAYING } from "../features/station/playMessages";

/** What a number is called, and its bounds. */
export type Steps = { label: string; unit: string; min: number; max: number; step: number };

/** Whether a value may be used; NaN stands for an empty field. */
export const isWithin = ({ min, max }: Pick<Steps, "min" | "max">, value: number): boolean =>
  value >= min && value <= max;

/**
 * A number that is changed by finger, in steps, or typed. What is shown is what `onChange` was given: an empty field gives NaN and a
 * number out of range itself, both with an error; whoever uses the value asks `isWithin` first.
 */
export function Stepper(props: {
  field: Steps;
  value: number;
  disabled?: boolean;
  onChange: (value: number) => void;
}) {
  const { value, disabled = false, onChange } = props;
  const { label, unit, min, max, step } = props.field;
  const id = useId();
  const give = (given: number) => onChange(Math.min(max, Math.max(min, Number.isNaN(given) ? min : given)));
  const fits = isWithin(props.field, value);
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
          clampBehavior="none"
          value={Number.isNaN(value) ? "" : value}
          error={!fits && !disabled}
          onChange={(given) => onChange(typeof given === "number" ? given : Number.NaN)}
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
      {!fits && !disabled && (
        <Text size="sm" c="grape.9" role="alert">
          {PLAYING.outOfRange(min, max, unit)}
        </Text>
      )}
    </Stack>
  );
}
