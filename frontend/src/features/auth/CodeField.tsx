import { TextInput } from "@mantine/core";
import classes from "./access.module.css";
import { SIGN_IN } from "./authLayoutMessages";

/** The field for a code of the authenticator app, or a recovery code. */
export function CodeField({ value, onChange }: { value: string; onChange: (code: string) => void }) {
  return (
    <TextInput
      className={classes.code ?? ""}
      label={SIGN_IN.code}
      description={SIGN_IN.codeMeans}
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
