import { Button, type ButtonProps, Group, PasswordInput, Stack } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { type ReactNode, useState } from "react";
import { ProblemError } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import { useMe } from "./hooks";
import { OpenIdReauthentication } from "./OpenIdReauthentication";

/**
 * A button for a sensitive action. It asks for the password if the service requires it, so that another person
 * at an unlocked screen cannot take the action.
 */
export function ReauthenticateForm<Result>(
  props: ButtonProps & {
    action: (password: string | null) => Promise<Result>;
    onDone: (result: Result) => void;
    children: ReactNode;
  },
) {
  const { action, onDone, children, ...buttonProps } = props;
  const [password, setPassword] = useState("");
  const [passwordNeeded, setPasswordNeeded] = useState(false);
  const mutation = useMutation({
    mutationFn: () => action(passwordNeeded ? password : null),
    onSuccess: onDone,
    onError: (error) => {
      if (error instanceof ProblemError && error.code === "password_needed") setPasswordNeeded(true);
    },
  });
  const me = useMe();
  const code = mutation.error instanceof ProblemError ? mutation.error.code : null;
  const atProvider = code === "openid_needed" ? me?.openid : null;
  const notYetGiven = code === "password_needed";
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        mutation.mutate();
      }}
      noValidate
    >
      <Stack>
        {passwordNeeded && (
          <PasswordInput
            label={t("auth:reauthentication.password")}
            autoComplete="current-password"
            autoFocus
            value={password}
            onChange={(event) => setPassword(event.currentTarget.value)}
          />
        )}
        {atProvider && (
          <OpenIdReauthentication name={atProvider} nextStep={t("auth:reauthentication.pressAgain")} />
        )}
        {!notYetGiven && !atProvider && <ProblemNote error={mutation.error} />}
        <Group>
          <Button
            type="submit"
            {...buttonProps}
            disabled={buttonProps.disabled || (passwordNeeded && password === "")}
            loading={mutation.isPending}
          >
            {children}
          </Button>
        </Group>
      </Stack>
    </form>
  );
}
