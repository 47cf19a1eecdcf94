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
import { currentAddress, openIdAddress } from "./openId";
import { UserNameField } from "./UserNameField";

/** Asks for name and password, then for the second factor if required. The requested page follows. */
export function SignInPage({ why }: { why: keyof typeof WHY }) {
  useTitle(SIGN_IN.title);
  const [username, setUsername] = useState("");
  const [password, setPassword] = useState("");
  const [code, setCode] = useState("");
  const signIn = useMutation({
    mutationFn: () => api.signIn({ username, password, code: code.trim() || null }),
    onSuccess: (me) => authStore.signedIn(me),
  });
  const problemCode = signIn.error instanceof ProblemError ? signIn.error.code : null;
  // After a wrong code the code field stays, and the password is not asked for again.
  const [codeNeeded, setCodeNeeded] = useState(false);
  if (problemCode === "second_factor_needed" && !codeNeeded) setCodeNeeded(true);
  const loginMethods = useQuery({
    queryKey: ["ways-in"],
    queryFn: api.loginMethods,
    staleTime: Number.POSITIVE_INFINITY,
  });
  const submit = (event: FormEvent) => {
    event.preventDefault();
    signIn.mutate();
  };
  const notice = WHY[why];
  return (
    <AuthLayout title={SIGN_IN.title}>
      {notice && (
        <Alert color="indigo" variant="light" icon={<IconInfoCircle />} role="status">
          {notice}
        </Alert>
      )}
      <form onSubmit={submit} noValidate>
        <Stack>
          {codeNeeded ? (
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
          {problemCode !== "second_factor_needed" && <ProblemNote error={signIn.error} />}
          <Button
            type="submit"
            size="lg"
            leftSection={<IconLogin size={22} />}
            loading={signIn.isPending}
            disabled={username.trim() === "" || password === "" || (codeNeeded && code.trim() === "")}
          >
            {SIGN_IN.signIn}
          </Button>
          {codeNeeded && (
            <Button
              variant="subtle"
              onClick={() => {
                setCodeNeeded(false);
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
      {loginMethods.data?.openid && !codeNeeded && (
        <Button component="a" href={openIdAddress(currentAddress())} size="lg" variant="default">
          {SIGN_IN.with(loginMethods.data.openid)}
        </Button>
      )}
      <ButtonLink to="/set-password" variant="subtle">
        {SIGN_IN.oneTimeCode}
      </ButtonLink>
      <Text size="sm">{SIGN_IN.withoutIt}</Text>
    </AuthLayout>
  );
}
