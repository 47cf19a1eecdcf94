import { Button, Stack, Text } from "@mantine/core";
import { useId } from "react";
import { t } from "../../../lib/i18n";
import classes from "./sessionWizard.module.css";

const PAIN = Array.from({ length: 11 }, (_, pain) => pain);

/** A pain score from 0 to 10 (numeric rating scale). One press sets it. */
export function NrsScale(props: {
  label: string;
  value: number | null;
  disabled?: boolean;
  onChange: (pain: number) => void;
}) {
  const { label, value, disabled = false, onChange } = props;
  const id = useId();
  return (
    <Stack gap="xs" role="group" aria-labelledby={id} className={classes.scaleFrame ?? ""}>
      <Text size="lg" fw={600} id={id}>
        {label}
      </Text>
      <div className={classes.scale}>
        {PAIN.map((pain) => (
          <Button
            key={pain}
            h={56}
            p={0}
            fz={22}
            variant={pain === value ? "filled" : "default"}
            aria-pressed={pain === value}
            aria-label={t("station:wizard.painButton", { label, pain })}
            disabled={disabled}
            onClick={() => onChange(pain)}
          >
            {pain}
          </Button>
        ))}
      </div>
      <Text size="sm">{t("station:wizard.painScale")}</Text>
    </Stack>
  );
}
