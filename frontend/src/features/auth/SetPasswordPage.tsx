import { Button, Stack, Text, TextInput } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useNavigate } from "@tanstack/react-router";
import { type FormEvent, type ReactNode, useState } from "react";
import { useTitle } from "../../app/title";
import { api, type Me, ProblemError } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ButtonLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { AuthLayout } from "./AuthLayout";
import classes from "./access.module.css";
import { authStore } from "./authState";
import { readFragment } from "./linkFragment";
import { isConfirmed, NewPassword, NO_PASSWORD } from "./NewPassword";
import { UserNameField } from "./UserNameField";

/** Creates the first administrator. The link that the service prints opens this page. */
export function SetUpPage() {
  const [link] = useState(() => readFragment("secret"));
  const [name, setName] = useState("");
  const [username, setUsername] = useState("");
  const [chosen, setChosen] = useState(NO_PASSWORD);
  const finish = useFinishSignIn();
  const setUp = useMutation({
    mutationFn: () => api.setUp({ secret: link, username, name, password: chosen.password }),
    onSuccess: finish,
  });
  const fields = setUp.error instanceof ProblemError ? setUp.error.fields : {};
  useTitle(t("auth:setUp.title"));
  if (!link) {
    return (
      <AuthLayout title={t("auth:setUp.title")}>
        <Text>{t("auth:setUp.noLink")}</Text>
      </AuthLayout>
    );
  }
  return (
    <AuthLayout title={t("auth:setUp.title")}>
      <Text>{t("auth:setUp.description")}</Text>
      <PasswordForm
        label={t("auth:setUp.create")}
        ready={isConfirmed(chosen) && name.trim() !== "" && username.trim() !== ""}
        pending={setUp.isPending}
        onSubmit={() => setUp.mutate()}
      >
        <TextInput
          label={t("auth:setUp.name")}
          description={t("auth:setUp.nameHint")}
          autoComplete="name"
          size="lg"
          value={name}
          error={fields.name}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <UserNameField
          description={t("auth:setUp.usernameHint")}
          value={username}
          error={fields.username}
          onChange={setUsername}
        />
        <NewPassword value={chosen} error={fields.password} onChange={setChosen} />
        <ProblemNote error={setUp.error} />
      </PasswordForm>
    </AuthLayout>
  );
}

/** Sets a password with an administrator's one-time code, for a new or reset account. */
export function SetPasswordPage() {
  const [code, setCode] = useState(() => readFragment("code"));
  const [username, setUsername] = useState("");
  const [chosen, setChosen] = useState(NO_PASSWORD);
  const finish = useFinishSignIn();
  const navigate = useNavigate();
  const set = useMutation({
    mutationFn: async () => {
      const { password } = chosen;
      await api.setPassword({ username, code, password });
      // An account with a second factor also needs a code, for which the sign-in page asks.
      return api.signIn({ username, password }).catch(() => null);
    },
    onSuccess: (me) => (me ? finish(me) : navigate({ to: "/", replace: true })),
  });
  const fields = set.error instanceof ProblemError ? set.error.fields : {};
  useTitle(t("auth:password.setting"));
  return (
    <AuthLayout title={t("auth:password.setting")}>
      <Text>{t("auth:password.settingHint")}</Text>
      <PasswordForm
        label={t("auth:password.set")}
        ready={isConfirmed(chosen) && code.trim() !== "" && username.trim() !== ""}
        pending={set.isPending}
        onSubmit={() => set.mutate()}
      >
        <UserNameField value={username} error={fields.username} onChange={setUsername} />
        <TextInput
          className={classes.code ?? ""}
          label={t("auth:password.code")}
          autoComplete="one-time-code"
          autoCapitalize="none"
          spellCheck={false}
          size="lg"
          value={code}
          error={fields.code}
          onChange={(event) => setCode(event.currentTarget.value)}
        />
        <NewPassword value={chosen} error={fields.password} onChange={setChosen} />
        <ProblemNote error={set.error} />
      </PasswordForm>
      <ButtonLink to="/" variant="subtle">
        {t("auth:password.back")}
      </ButtonLink>
    </AuthLayout>
  );
}

/** Return a callback that signs in and opens the first page. Opening it removes the code from the address. */
function useFinishSignIn() {
  const navigate = useNavigate();
  return (me: Me) => {
    authStore.signedIn(me);
    void navigate({ to: "/", replace: true });
  };
}

function PasswordForm(props: {
  label: string;
  ready: boolean;
  pending: boolean;
  onSubmit: () => void;
  children: ReactNode;
}) {
  const submit = (event: FormEvent) => {
    event.preventDefault();
    if (props.ready) props.onSubmit();
  };
  return (
    <form onSubmit={submit} noValidate>
      <Stack>
        {props.children}
        <Button type="submit" size="lg" disabled={!props.ready} loading={props.pending}>
          {props.label}
        </Button>
      </Stack>
    </form>
  );
}
