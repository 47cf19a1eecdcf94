import { Button, Card, Group, PasswordInput, Stack, Text, Title } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { useTitle } from "../../app/title";
import { api, type Me, ProblemError } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import { TitleWithHelp } from "../../ui/TitleWithHelp";
import { AccessTokens } from "./AccessTokens";
import { AuthLayout } from "./AuthLayout";
import classes from "./access.module.css";
import { authStore } from "./authState";
import { useMe } from "./hooks";
import { LanguageChoice } from "./LanguageChoice";
import { isConfirmed, NewPassword, NO_PASSWORD } from "./NewPassword";
import { ReauthenticateForm } from "./ReauthenticateForm";
import { SecondFactor } from "./SecondFactor";

/** The user's own account: name, language, password, second factor, login sessions and access tokens. */
export function AccountPage() {
  useTitle(t("auth:account.title"));
  const me = useMe();
  if (!me) return null;
  return (
    <Stack gap="lg">
      <div>
        <Title order={1} size="h2">
          {me.name}
        </Title>
        <Text>{t(`auth:account.who.${me.role}`, { username: me.username })}</Text>
        {me.stations.length > 0 && <Text>{t("auth:account.worksAt", { stations: me.stations })}</Text>}
      </div>
      <div className={classes.cards}>
        <Card withBorder component="section" aria-label={t("auth:language.label")}>
          <Title order={2} size="h3" mb="md">
            {t("auth:language.label")}
          </Title>
          <LanguageChoice own />
        </Card>
        {me.password && (
          <Card withBorder component="section" aria-label={t("auth:account.password")}>
            <Title order={2} size="h3" mb="md">
              {t("auth:account.password")}
            </Title>
            <ChangePassword me={me} />
          </Card>
        )}
        <Card withBorder component="section" aria-label={t("auth:account.secondFactor")}>
          <Title order={2} size="h3" mb="md">
            {t("auth:account.secondFactor")}
          </Title>
          <SecondFactor me={me} onChanged={() => void authStore.refresh()} />
        </Card>
        <Card withBorder component="section" aria-label={t("auth:account.whereSignedIn")}>
          <TitleWithHelp order={2} size="h3" mb="md" topic="signIn">
            {t("auth:account.whereSignedIn")}
          </TitleWithHelp>
          <LoginSessions />
        </Card>
        <Card withBorder component="section" aria-label={t("auth:tokens.title")}>
          <TitleWithHelp order={2} size="h3" mb="md" topic="scripts">
            {t("auth:tokens.title")}
          </TitleWithHelp>
          <AccessTokens />
        </Card>
      </div>
    </Stack>
  );
}

/** Shown to a user who must set up a second factor before anything else. */
export function EnrolPage({ me, onDone }: { me: Me; onDone: () => void }) {
  useTitle(t("auth:account.secondFactor"));
  return (
    <AuthLayout title={t("auth:secondFactor.needed")}>
      {me.enrolling && <Text>{t(`auth:secondFactor.neededOf.${me.role}`, { name: me.name })}</Text>}
      <SecondFactor me={me} onChanged={onDone} />
      <Button variant="subtle" onClick={() => void authStore.signOut()}>
        {t("auth:menu.signOut")}
      </Button>
    </AuthLayout>
  );
}

function ChangePassword({ me }: { me: Me }) {
  const [oldPassword, setOldPassword] = useState("");
  const [chosen, setChosen] = useState(NO_PASSWORD);
  const change = useMutation({
    mutationFn: () => api.changePassword({ old_password: oldPassword, password: chosen.password }),
    onSuccess: () => {
      setOldPassword("");
      setChosen(NO_PASSWORD);
    },
  });
  const fields = change.error instanceof ProblemError ? change.error.fields : {};
  const submit = (event: FormEvent) => {
    event.preventDefault();
    change.mutate();
  };
  return (
    <form onSubmit={submit} noValidate>
      <Stack>
        <input type="text" autoComplete="username" value={me.username} readOnly hidden />
        <PasswordInput
          label={t("auth:account.currentPassword")}
          autoComplete="current-password"
          size="lg"
          value={oldPassword}
          error={fields.old_password}
          onChange={(event) => setOldPassword(event.currentTarget.value)}
        />
        <NewPassword value={chosen} error={fields.password} onChange={setChosen} />
        <ProblemNote error={change.error} />
        <Group>
          <Button
            type="submit"
            disabled={oldPassword === "" || !isConfirmed(chosen)}
            loading={change.isPending}
          >
            {t("auth:account.changePassword")}
          </Button>
          {change.isSuccess && <Text role="status">{t("auth:account.passwordChanged")}</Text>}
        </Group>
      </Stack>
    </form>
  );
}

/** The user's login sessions, each with a button that ends it. */
function LoginSessions() {
  const queries = useQueryClient();
  const sessions = useQuery({ queryKey: ["own-sign-ins"], queryFn: api.loginSessions });
  return (
    <Stack>
      <ProblemNote error={sessions.error} />
      {(sessions.data?.items ?? []).map((session) => (
        <Group key={session.id} justify="space-between" wrap="nowrap">
          <div>
            <Text fw={600}>
              {session.here
                ? t("auth:account.thisBrowser", { since: formatMoment(session.began_at) })
                : t("auth:account.anotherBrowser", {
                    address: session.address,
                    since: formatMoment(session.began_at),
                  })}
            </Text>
            <Text size="sm">
              {t("auth:account.lastUsed", { moment: formatMoment(session.seen_at), agent: session.agent })}
            </Text>
          </div>
          {!session.here && (
            <ReauthenticateForm
              variant="default"
              action={(password) => api.endLoginSession(session.id, password)}
              onDone={() => void queries.invalidateQueries({ queryKey: ["own-sign-ins"] })}
            >
              {t("auth:account.signOutBrowser")}
            </ReauthenticateForm>
          )}
        </Group>
      ))}
    </Stack>
  );
}
