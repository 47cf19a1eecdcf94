import { TextInput } from "@mantine/core";
import { t } from "../../lib/i18n";
import classes from "./access.module.css";

/** The field for a code of the authenticator app, or a recovery code. */
export function CodeField(props: { value: string; onChange: (code: string) => void; focused?: boolean }) {
  const { value, onChange, focused = true } = props;
  return (
    <TextInput
      className={classes.code ?? ""}
      label={t("auth:signIn.code")}
      description={t("auth:signIn.codeHint")}
      autoComplete="one-time-code"
      inputMode="text"
      autoCapitalize="none"
      data-autofocus={focused || undefined}
      autoFocus={focused}
      size="lg"
      value={value}
      onChange={(event) => onChange(event.currentTarget.value)}
    />
  );
}
