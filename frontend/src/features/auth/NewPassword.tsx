import { PasswordInput } from "@mantine/core";
import { t } from "../../lib/i18n";

/** A new password, typed twice to catch typing errors. */
type NewPasswordInput = { password: string; repeated: string };

export const NO_PASSWORD: NewPasswordInput = { password: "", repeated: "" };

/** True if both fields agree. The service checks the password's strength. */
export const isConfirmed = ({ password, repeated }: NewPasswordInput): boolean =>
  password !== "" && password === repeated;

/** Two fields for a new password. Pasting is allowed, because password managers need it. */
export function NewPassword(props: {
  value: NewPasswordInput;
  error?: string | undefined;
  onChange: (value: NewPasswordInput) => void;
}) {
  const { value, onChange } = props;
  const differs = value.repeated !== "" && value.repeated !== value.password;
  return (
    <>
      <PasswordInput
        label={t("auth:password.choose")}
        description={t("auth:password.chooseHint")}
        autoComplete="new-password"
        size="lg"
        value={value.password}
        error={props.error}
        onChange={(event) => onChange({ ...value, password: event.currentTarget.value })}
      />
      <PasswordInput
        label={t("auth:password.again")}
        autoComplete="new-password"
        size="lg"
        value={value.repeated}
        error={differs && t("auth:password.differs")}
        onChange={(event) => onChange({ ...value, repeated: event.currentTarget.value })}
      />
    </>
  );
}
