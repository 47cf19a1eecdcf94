import { PasswordInput } from "@mantine/core";
import { PASSWORD } from "./authLayoutMessages";

/** A password is chosen: typed twice, so that a slip locks nobody out. */
export type Chosen = { password: string; again: string };

export const NOTHING_CHOSEN: Chosen = { password: "", again: "" };

/** Whether it may be sent; whether it is good enough is the service's to say. */
export const isChosen = ({ password, again }: Chosen): boolean => password !== "" && password === again;

/** Two fields for a new password. Pasting is welcome: password managers do it. */
export function NewPassword(props: {
  value: Chosen;
  error?: string | undefined;
  onChange: (value: Chosen) => void;
}) {
  const { value, onChange } = props;
  const differs = value.again !== "" && value.again !== value.password;
  return (
    <>
      <PasswordInput
        label={PASSWORD.choose}
        description={PASSWORD.chooseMeans}
        autoComplete="new-password"
        size="lg"
        value={value.password}
        error={props.error}
        onChange={(event) => onChange({ ...value, password: event.currentTarget.value })}
      />
      <PasswordInput
        label={PASSWORD.again}
        autoComplete="new-password"
        size="lg"
        value={value.again}
        error={differs && PASSWORD.differs}
        onChange={(event) => onChange({ ...value, again: event.currentTarget.value })}
      />
    </>
  );
}
