import { Button, type ButtonProps, Group, PasswordInput, Stack } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { type ReactNode, useState } from "react";
import { ProblemError } from "../../lib/api/client";
import { ProblemNote } from "../../ui/ProblemNote";
import { AGAIN } from "./authLayoutMessages";
import { useMe } from "./hooks";
import { OpenIdReauthentication } from "./OpenIdReauthentication";

/** Something that a passer-by at an open screen must not do: where the service wants the password again, it is asked for. */
export function ReauthenticateForm<Told>(
  props: ButtonProps & {
    act: (password: string | null) => Promise<Told>;
    onDone: (told: Told) => void;
    children: ReactNode;
  },
) {
  const { act, onDone, children, ...look } = props;
  const [password, setPassword] = useState("");
  const [asked, setAsked] = useState(false);
  const doing = useMutation({
    mutationFn: () => act(asked ? password : null),
    onSuccess: onDone,
    onError: (error) => {
      if (error instanceof ProblemError && error.code === "password_needed") setAsked(true);
    },
  });
  const me = useMe();
  const code = doing.error instanceof ProblemError ? doing.error.code : null;
  const atProvider = code === "openid_needed" ? me?.openid : null;
  const needed = code === "password_needed";
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        doing.mutate();
      }}
      noValidate
    >
      <Stack>
        {asked && (
          <PasswordInput
            label={AGAIN.password}
            autoComplete="current-password"
            autoFocus
            value={password}
            onChange={(event) => setPassword(event.currentTarget.value)}
          />
        )}
        {atProvider && <OpenIdReauthentication name={atProvider} then={AGAIN.thenPress} />}
        {!needed && !atProvider && <ProblemNote error={doing.error} />}
        <Group>
          <Button type="submit" {...look} disabled={asked && password === ""} loading={doing.isPending}>
            {children}
          </Button>
        </Group>
      </Stack>
    </form>
  );
}
