import { TextInput } from "@mantine/core";
import { SIGN_IN } from "./authLayoutMessages";

/** A user name as it is typed: nothing corrects it, and password managers know it for one. */
export function UserNameField(props: {
  value: string;
  onChange: (username: string) => void;
  description?: string;
  error?: string | undefined;
  autoFocus?: boolean;
}) {
  const { onChange, ...shown } = props;
  return (
    <TextInput
      label={SIGN_IN.username}
      autoComplete="username"
      autoCapitalize="none"
      autoCorrect="off"
      spellCheck={false}
      size="lg"
      {...shown}
      onChange={(event) => onChange(event.currentTarget.value)}
    />
  );
}
