import { Button, Text } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useNavigate } from "@tanstack/react-router";
import { useEffect, useState } from "react";
import { useTitle } from "../../app/title";
import { api } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import { AuthLayout } from "./AuthLayout";
import { authStore } from "./authState";
import { readFragment } from "./linkFragment";

/** Signs in. The links of the demonstration clinic lead to this page. */
export function LinkPage() {
  useTitle(t("auth:signIn.title"));
  const navigate = useNavigate();
  const [secret] = useState(() => readFragment("link"));
  const signIn = useMutation({
    mutationFn: (link: string) => api.signInByLink(link),
    onSuccess: (me) => {
      authStore.signedIn(me);
      void navigate({ to: "/", replace: true });
    },
  });
  const { mutate } = signIn;
  useEffect(() => {
    if (secret) mutate(secret);
    else void navigate({ to: "/", replace: true });
  }, [secret, mutate, navigate]);
  return (
    <AuthLayout title={t("auth:signIn.title")}>
      {signIn.error ? (
        <>
          <ProblemNote error={signIn.error} />
          <Button onClick={() => void navigate({ to: "/", replace: true })}>
            {t("auth:signIn.byPassword")}
          </Button>
        </>
      ) : (
        <Text role="status">{t("auth:signIn.wait")}</Text>
      )}
    </AuthLayout>
  );
}
