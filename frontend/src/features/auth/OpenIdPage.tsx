import { Button, Stack, Text } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useRouter } from "@tanstack/react-router";
import { type FormEvent, useEffect, useState } from "react";
import { useTitle } from "../../app/title";
import { api, type Schemas } from "../../lib/api/client";
import { ProblemNote } from "../../ui/ProblemNote";
import { AuthLayout } from "./AuthLayout";
import { SIGN_IN } from "./authLayoutMessages";
import { authStore } from "./authState";
import { CodeField } from "./CodeField";
import { fromLink } from "./fromLink";
import { OPENID_PATH } from "./openId";

/** Read once: what the provider sends stays neither in the address nor in the history. */
function cameWith(): Schemas["OidcCallback"] | null {
  const given = new URLSearchParams(location.search);
  const state = given.get("state");
  return state === null ? null : { state, code: given.get("code") ?? "", iss: given.get("iss") };
}

/**
 * The way to the clinic's OpenID provider and back. Without an answer of the provider in the address it leads there; with one it
 * signs in, and goes where somebody wanted to go. A locked screen opens it in a tab of its own, so that Stop stays in sight.
 */
export function OpenIdPage() {
  useTitle(SIGN_IN.title);
  const router = useRouter();
  const [back] = useState(cameWith);
  // Only the links of openId.ts lead away: this screen is mounted anew while the one that was wanted is still being fetched.
  const [leaving] = useState(() => location.hash !== "");
  const [to] = useState(() => fromLink("to"));
  const [code, setCode] = useState("");
  const [closing, setClosing] = useState(false);
  const arrive = (came: Schemas["LoginResult"]) => {
    if (!came.me) return;
    authStore.came(came.me);
    if (came.to) router.history.replace(came.to);
    else setClosing(true);
  };
  const begin = useMutation({
    mutationFn: () => api.beginOpenId(to),
    onSuccess: ({ address }) => location.assign(address),
  });
  const signIn = useMutation({ mutationFn: api.signInByOpenId, onSuccess: arrive });
  const confirm = useMutation({ mutationFn: () => api.confirmOpenId(code.trim()), onSuccess: arrive });
  const { mutate: leave } = begin;
  const { mutate: come } = signIn;
  useEffect(() => {
    if (back) {
      history.replaceState(history.state, "", OPENID_PATH);
      come(back);
    } else if (leaving) leave();
  }, [back, leaving, come, leave]);
  const submit = (event: FormEvent) => {
    event.preventDefault();
    confirm.mutate();
  };
  const error = begin.error ?? signIn.error;
  if (closing) {
    return (
      <AuthLayout title={SIGN_IN.youAreBack}>
        <Text role="status">{SIGN_IN.unlocked}</Text>
        <Button onClick={() => window.close()}>{SIGN_IN.closeTab}</Button>
      </AuthLayout>
    );
  }
  return (
    <AuthLayout title={SIGN_IN.title}>
      {error ? (
        <>
          <ProblemNote error={error} />
          <Button onClick={() => router.history.replace("/")}>{SIGN_IN.back}</Button>
        </>
      ) : signIn.data ? (
        <form onSubmit={submit} noValidate>
          <Stack>
            <CodeField value={code} onChange={setCode} />
            <ProblemNote error={confirm.error} />
            <Button type="submit" size="lg" loading={confirm.isPending} disabled={code.trim() === ""}>
              {SIGN_IN.signIn}
            </Button>
          </Stack>
        </form>
      ) : back || leaving ? (
        <Text role="status">{SIGN_IN.oneMoment}</Text>
      ) : (
        <Button onClick={() => router.history.replace("/")}>{SIGN_IN.back}</Button>
      )}
    </AuthLayout>
  );
}
