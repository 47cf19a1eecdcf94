import { TextInput } from "@mantine/core";
import { t } from "../../lib/i18n";

/** A field for a user name. It has no autocorrection, and password managers recognize it. */
export function UserNameField(props: {
  value: string;
  onChange: (username: string) => void;
  description?: string;
  error?: string | undefined;
  autoFocus?: boolean;
}) {
  const { onChange, ...fieldProps } = props;
  return (
    <TextInput
      label={t("auth:signIn.username")}
      autoComplete="username"
      autoCapitalize="none"
      autoCorrect="off"
      spellCheck={false}
      size="lg"
      {...fieldProps}
      onChange={(event) => onChange(event.currentTarget.value)}
    />
  );
}
