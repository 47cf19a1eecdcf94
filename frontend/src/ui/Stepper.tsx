import { ActionIcon, Group, NumberInput, Stack, Text } from "@mantine/core";
import { IconMinus, IconPlus } from "@tabler/icons-react";
import { type ReactNode, useId } from "react";
import { t } from "../lib/i18n";

/** A number's label, unit, bounds and step. */
export type Steps = { label: string; unit: string; min: number; max: number; step: number };

/** Return true if the value is within the bounds. NaN means an empty field and is outside the bounds. */
export const isWithin = ({ min, max }: Pick<Steps, "min" | "max">, value: number): boolean =>
  value >= min && value <= max;

/**
 * A number with step buttons and a field. The field shows exactly the last value of `onChange`, which is NaN
 * for an empty field and may be out of range. In both cases the field shows an error; the caller checks
 * `isWithin` before use.
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
  // Steps of 0.1 must not add up to 0.7999999999999999.
  const changeTo = (number: number) =>
    onChange(Math.min(max, Math.max(min, Number.isNaN(number) ? min : Math.round(number * 1000) / 1000)));
  const valid = isWithin(props.field, value);
  return (
    <Stack gap={4} role="group" aria-labelledby={id}>
      <Text size="lg" fw={600} id={id}>
        {label}
      </Text>
      <Group wrap="nowrap" gap="xs">
        <StepButton
          label={t("station:settings.decrease", { label })}
          disabled={disabled || value <= min}
          onClick={() => changeTo(value - step)}
        >
          <IconMinus size={22} />
        </StepButton>
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
          error={!valid && !disabled}
          onChange={(input) => onChange(typeof input === "number" ? input : Number.NaN)}
          styles={{ input: { textAlign: "center" } }}
        />
        <StepButton
          label={t("station:settings.increase", { label })}
          disabled={disabled || value >= max}
          onClick={() => changeTo(value + step)}
        >
          <IconPlus size={22} />
        </StepButton>
      </Group>
      {!valid && !disabled && (
        <Text size="sm" c="grape.9" role="alert">
          {t("station:settings.outOfRange", { min, max, unit: unit && ` ${unit}` })}
        </Text>
      )}
    </Stack>
  );
}

function StepButton(props: { label: string; disabled: boolean; onClick: () => void; children: ReactNode }) {
  const { label, ...button } = props;
  return <ActionIcon size={44} variant="default" aria-label={label} {...button} />;
}
