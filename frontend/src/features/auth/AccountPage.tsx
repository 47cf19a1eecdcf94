import { Button, Card, Group, PasswordInput, Stack, Text, Title } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { useTitle } from "../../app/title";
import { api, type Me, ProblemError } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { ProblemNote } from "../../ui/ProblemNote";
import { AuthLayout } from "./AuthLayout";
import { ACCOUNT, MENU, SECOND_FACTOR } from "./accountMessages";
import { authStore } from "./authState";
import { useMe } from "./hooks";
import { LanguageChoice } from "./LanguageChoice";
import { LANGUAGE_WORDS } from "./messages";
import { isConfirmed, NewPassword, NO_PASSWORD } from "./NewPassword";
import { ReauthenticateForm } from "./ReauthenticateForm";
import { SecondFactor } from "./SecondFactor";

/** The user's own account: name, language, password, second factor and login sessions. */
export function AccountPage() {
  useTitle(ACCOUNT.title);
  const me = useMe();
  if (!me) return null;
  return (
    <Stack maw={720} gap="lg">
      <div>
        <Title order={1} size="h2">
          {me.name}
        </Title>
        <Text>{ACCOUNT.who(me.username, me.role)}</Text>
        {me.stations.length > 0 && <Text>{ACCOUNT.worksAt(me.stations)}</Text>}
      </div>
      <Card withBorder component="section" aria-label={LANGUAGE_WORDS.language}>
        <Title order={2} size="h3" mb="md">
          {LANGUAGE_WORDS.language}
        </Title>
        <LanguageChoice own />
      </Card>
      {me.password && (
        <Card withBorder component="section" aria-label={ACCOUNT.password}>
          <Title order={2} size="h3" mb="md">
            {ACCOUNT.password}
          </Title>
          <ChangePassword me={me} />
        </Card>
      )}
      <Card withBorder component="section" aria-label={ACCOUNT.secondFactor}>
        <Title order={2} size="h3" mb="md">
          {ACCOUNT.secondFactor}
        </Title>
        <SecondFactor me={me} onChanged={() => void authStore.refresh()} />
      </Card>
      <Card withBorder component="section" aria-label={ACCOUNT.whereSignedIn}>
        <Title order={2} size="h3" mb="md">
          {ACCOUNT.whereSignedIn}
        </Title>
        <LoginSessions />
      </Card>
    </Stack>
  );
}

/** Shown to a user who must set up a second factor before anything else. */
export function EnrolPage({ me, onDone }: { me: Me; onDone: () => void }) {
  useTitle(ACCOUNT.secondFactor);
  return (
    <AuthLayout title={SECOND_FACTOR.needed}>
      {me.enrolling && <Text>{SECOND_FACTOR.neededOf(me.role, me.name)}</Text>}
      <SecondFactor me={me} onChanged={onDone} />
      <Button variant="subtle" onClick={() => void authStore.signOut()}>
        {MENU.signOut}
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
          label={ACCOUNT.presentPassword}
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
            {ACCOUNT.changePassword}
          </Button>
          {change.isSuccess && <Text role="status">{ACCOUNT.changed}</Text>}
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
                ? ACCOUNT.thisBrowser(formatMoment(session.began_at))
                : ACCOUNT.anotherBrowser(session.address, formatMoment(session.began_at))}
            </Text>
            <Text size="sm">{ACCOUNT.lastUsed(formatMoment(session.seen_at), session.agent)}</Text>
          </div>
          {!session.here && (
            <ReauthenticateForm
              variant="default"
              action={(password) => api.endLoginSession(session.id, password)}
              onDone={() => void queries.invalidateQueries({ queryKey: ["own-sign-ins"] })}
            >
              {ACCOUNT.signItOut}
            </ReauthenticateForm>
          )}
        </Group>
      ))}
    </Stack>
  );
}
