import "./catalogue";
import { Button, Group } from "@mantine/core";
import { t } from "../../lib/i18n";
import { MOTORS } from "./editFields";

/** A button for each motor. The chosen ones are pressed. */
export function MotorButtons(props: { label: string; chosen: number[]; onPress: (motor: number) => void }) {
  return (
    <Group gap="xs" role="group" aria-label={props.label}>
      {MOTORS.map((motor) => (
        <Button
          key={motor}
          size="lg"
          variant={props.chosen.includes(motor) ? "filled" : "default"}
          aria-pressed={props.chosen.includes(motor)}
          onClick={() => props.onPress(motor)}
        >
          {t("recordings:edit.motor", { motor })}
        </Button>
      ))}
    </Group>
  );
}
