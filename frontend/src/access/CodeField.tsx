import { TextInput } from "@mantine/core";
import classes from "./access.module.css";

/** Of the second factor: what an authenticator app shows, or a recovery code. */
export function CodeField({ value, onChange }: { value: string; onChange: (code: string) => void }) {
  return (
    <TextInput
      className={classes.code ?? ""}
      label="Code"
      description="The six digits that your authenticator app shows now, or one of your recovery codes."
      autoComplete="one-time-code"
      inputMode="text"
      autoCapitalize="none"
      data-autofocus
      autoFocus
      size="lg"
      value={value}
      onChange={(event) => onChange(event.currentTarget.value)}
    />
  );
}
