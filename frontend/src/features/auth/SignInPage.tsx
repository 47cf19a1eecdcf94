import { Alert, Button, PasswordInput, Stack, Text } from "@mantine/core";
import { IconInfoCircle, IconLogin } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { useTitle } from "../../app/title";
import { api, ProblemError } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ButtonLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { AuthLayout } from "./AuthLayout";
import { type AuthState, authStore } from "./authState";
import { CodeField } from "./CodeField";
import { currentAddress, openIdAddress } from "./openId";
import { UserNameField } from "./UserNameField";

/** Asks for name and password, then for the second factor if it is required. Then the requested page is shown. */
export function SignInPage({ why }: { why: Extract<AuthState, { is: "out" }>["why"] }) {
  useTitle(t("auth:signIn.title"));
  // After a wrong code the field for the code stays, and the user need not enter the password again.
  const [codeNeeded, setCodeNeeded] = useState(false);
  const notice = why === "never" ? null : t(`auth:why.${why}`);
  return (
    <AuthLayout title={t("auth:signIn.title")}>
      {notice && (
        <Alert color="indigo" variant="light" icon={<IconInfoCircle />} role="status">
          {notice}
        </Alert>
      )}
      <PasswordForm codeNeeded={codeNeeded} onCodeNeeded={setCodeNeeded} />
      {!codeNeeded && <OpenIdButton />}
      <ButtonLink to="/set-password" variant="subtle">
        {t("auth:signIn.oneTimeCode")}
      </ButtonLink>
      <Text size="sm">{t("auth:signIn.stopHint")}</Text>
    </AuthLayout>
  );
}

/** Signs in with name and password. Once the service has asked for a code, the form shows only the code field. */
function PasswordForm(props: { codeNeeded: boolean; onCodeNeeded: (needed: boolean) => void }) {
  const { codeNeeded, onCodeNeeded } = props;
  const [username, setUsername] = useState("");
  const [password, setPassword] = useState("");
  const [code, setCode] = useState("");
  const signIn = useMutation({
    mutationFn: () => api.signIn({ username, password, code: code.trim() || null }),
    onSuccess: (me) => authStore.signedIn(me),
    onError: (error) => {
      if (isCodeNeeded(error)) onCodeNeeded(true);
    },
  });
  const submit = (event: FormEvent) => {
    event.preventDefault();
    signIn.mutate();
  };
  const startAgain = () => {
    onCodeNeeded(false);
    setCode("");
    setPassword("");
    signIn.reset();
  };
  return (
    <form onSubmit={submit} noValidate>
      <Stack>
        {codeNeeded ? (
          <CodeField value={code} onChange={setCode} />
        ) : (
          <>
            <UserNameField autoFocus value={username} onChange={setUsername} />
            <PasswordInput
              label={t("auth:signIn.password")}
              autoComplete="current-password"
              size="lg"
              value={password}
              onChange={(event) => setPassword(event.currentTarget.value)}
            />
          </>
        )}
        {!isCodeNeeded(signIn.error) && <ProblemNote error={signIn.error} />}
        <Button
          type="submit"
          size="lg"
          leftSection={<IconLogin size={22} />}
          loading={signIn.isPending}
          disabled={username.trim() === "" || password === "" || (codeNeeded && code.trim() === "")}
        >
          {t("auth:signIn.signIn")}
        </Button>
        {codeNeeded && (
          <Button variant="subtle" onClick={startAgain}>
            {t("auth:signIn.otherUser")}
          </Button>
        )}
      </Stack>
    </form>
  );
}

/** The link to the clinic's OpenID provider, if there is one. */
function OpenIdButton() {
  const loginMethods = useQuery({
    queryKey: ["sign-in-options"],
    queryFn: api.loginMethods,
    staleTime: Number.POSITIVE_INFINITY,
  });
  if (!loginMethods.data?.openid) return null;
  return (
    <Button component="a" href={openIdAddress(currentAddress())} size="lg" variant="default">
      {t("auth:signIn.with", { provider: loginMethods.data.openid })}
    </Button>
  );
}

const isCodeNeeded = (error: Error | null) =>
  error instanceof ProblemError && error.code === "second_factor_needed";
