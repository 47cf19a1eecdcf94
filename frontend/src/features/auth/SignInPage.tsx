import { Alert, Button, PasswordInput, Stack, Text } from "@mantine/core";
import { IconInfoCircle, IconLogin } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { useTitle } from "../../app/title";
import { api, ProblemError } from "../../lib/api/client";
import { ButtonLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { AuthLayout } from "./AuthLayout";
import { SIGN_IN, WHY } from "./authLayoutMessages";
import { authStore } from "./authState";
import { CodeField } from "./CodeField";
import { hereNow, openIdAddress } from "./openId";
import { UserNameField } from "./UserNameField";

/** Who is there: name and password, then the second factor where there is one. Afterwards one is where one wanted to go. */
export function SignInPage({ why }: { why: keyof typeof WHY }) {
  useTitle(SIGN_IN.title);
  const [username, setUsername] = useState("");
  const [password, setPassword] = useState("");
  const [code, setCode] = useState("");
  const signIn = useMutation({
    mutationFn: () => api.signIn({ username, password, code: code.trim() || null }),
    onSuccess: (me) => authStore.came(me),
  });
  const refused = signIn.error instanceof ProblemError ? signIn.error.code : null;
  // Asked for once, it stays: a code that was wrong is typed anew, the password is not.
  const [second, setSecond] = useState(false);
  if (refused === "second_factor_needed" && !second) setSecond(true);
  const ways = useQuery({ queryKey: ["ways-in"], queryFn: api.waysIn, staleTime: Number.POSITIVE_INFINITY });
  const submit = (event: FormEvent) => {
    event.preventDefault();
    signIn.mutate();
  };
  const told = WHY[why];
  return (
    <AuthLayout title={SIGN_IN.title}>
      {told && (
        <Alert color="indigo" variant="light" icon={<IconInfoCircle />} role="status">
          {told}
        </Alert>
      )}
      <form onSubmit={submit} noValidate>
        <Stack>
          {second ? (
            <CodeField value={code} onChange={setCode} />
          ) : (
            <>
              <UserNameField autoFocus value={username} onChange={setUsername} />
              <PasswordInput
                label={SIGN_IN.password}
                autoComplete="current-password"
                size="lg"
                value={password}
                onChange={(event) => setPassword(event.currentTarget.value)}
              />
            </>
          )}
          {refused !== "second_factor_needed" && <ProblemNote error={signIn.error} />}
          <Button
            type="submit"
            size="lg"
            leftSection={<IconLogin size={22} />}
            loading={signIn.isPending}
            disabled={username.trim() === "" || password === "" || (second && code.trim() === "")}
          >
            {SIGN_IN.signIn}
          </Button>
          {second && (
            <Button
              variant="subtle"
              onClick={() => {
                setSecond(false);
                setCode("");
                setPassword("");
                signIn.reset();
              }}
            >
              {SIGN_IN.somebodyElse}
            </Button>
          )}
        </Stack>
      </form>
      {ways.data?.openid && !second && (
        <Button component="a" href={openIdAddress(hereNow())} size="lg" variant="default">
          {SIGN_IN.with(ways.data.openid)}
        </Button>
      )}
      <ButtonLink to="/set-password" variant="subtle">
        {SIGN_IN.oneTimeCode}
      </ButtonLink>
      <Text size="sm">{SIGN_IN.withoutIt}</Text>
    </AuthLayout>
  );
}
