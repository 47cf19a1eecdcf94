import { Button, Stack, Text } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useRouter } from "@tanstack/react-router";
import { type FormEvent, useEffect, useState } from "react";
import { useTitle } from "../../app/title";
import { api, type Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import { AuthLayout } from "./AuthLayout";
import { authStore } from "./authState";
import { CodeField } from "./CodeField";
import { readFragment } from "./linkFragment";
import { OPENID_PATH } from "./openId";

/** Return the provider's response from the address, or null. */
function readCallback(): Schemas["OidcCallback"] | null {
  const params = new URLSearchParams(location.search);
  const state = params.get("state");
  return state === null ? null : { state, code: params.get("code") ?? "", iss: params.get("iss") };
}

/**
 * Redirects to the clinic's OpenID provider. If the address contains the provider's response, signs in and then
 * opens the requested page. The lock screen opens this page in another tab, so that Stop stays visible.
 */
export function OpenIdPage() {
  useTitle(t("auth:signIn.title"));
  const router = useRouter();
  const [callback] = useState(readCallback);
  // Only the links of openId.ts start a redirect, because this page is mounted again while the requested page
  // loads.
  const [redirecting] = useState(() => location.hash !== "");
  const [to] = useState(() => readFragment("to"));
  const [finished, setFinished] = useState(false);
  const finish = (result: Schemas["LoginResult"]) => {
    if (!result.me) return;
    authStore.signedIn(result.me);
    if (result.to) router.history.replace(result.to);
    else setFinished(true);
  };
  const beginLogin = useMutation({
    mutationFn: () => api.beginOpenId(to),
    onSuccess: ({ address }) => location.assign(address),
  });
  const signIn = useMutation({ mutationFn: api.signInByOpenId, onSuccess: finish });
  const { mutate: redirect } = beginLogin;
  const { mutate: sendCallback } = signIn;
  useEffect(() => {
    if (callback) {
      history.replaceState(history.state, "", OPENID_PATH);
      sendCallback(callback);
    } else if (redirecting) redirect();
  }, [callback, redirecting, sendCallback, redirect]);
  const error = beginLogin.error ?? signIn.error;
  if (finished) {
    return (
      <AuthLayout title={t("auth:signIn.done")}>
        <Text role="status">{t("auth:signIn.unlocked")}</Text>
        <Button onClick={() => window.close()}>{t("auth:signIn.closeTab")}</Button>
      </AuthLayout>
    );
  }
  return (
    <AuthLayout title={t("auth:signIn.title")}>
      {error ? (
        <>
          <ProblemNote error={error} />
          <Button onClick={() => router.history.replace("/")}>{t("auth:signIn.back")}</Button>
        </>
      ) : signIn.data ? (
        <SecondFactorForm onDone={finish} />
      ) : callback || redirecting ? (
        <Text role="status">{t("auth:signIn.wait")}</Text>
      ) : (
        <>
          <Text>{t("auth:signIn.noReply")}</Text>
          <Button onClick={() => router.history.replace("/")}>{t("auth:signIn.back")}</Button>
        </>
      )}
    </AuthLayout>
  );
}

/** Completes the login with the account's second factor. */
function SecondFactorForm({ onDone }: { onDone: (result: Schemas["LoginResult"]) => void }) {
  const [code, setCode] = useState("");
  const confirm = useMutation({ mutationFn: () => api.confirmOpenId(code.trim()), onSuccess: onDone });
  const submit = (event: FormEvent) => {
    event.preventDefault();
    confirm.mutate();
  };
  return (
    <form onSubmit={submit} noValidate>
      <Stack>
        <CodeField value={code} onChange={setCode} />
        <ProblemNote error={confirm.error} />
        <Button type="submit" size="lg" loading={confirm.isPending} disabled={code.trim() === ""}>
          {t("auth:signIn.signIn")}
        </Button>
      </Stack>
    </form>
  );
}
