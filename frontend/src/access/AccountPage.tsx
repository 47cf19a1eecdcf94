import { Button, Card, Group, PasswordInput, Stack, Text, Title } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { api, type Me, ProblemError } from "../api/client";
import { ProblemNote } from "../shared/problem";
import { useTitle } from "../shared/title";
import { Door } from "./Door";
import { useMe } from "./hooks";
import { isChosen, NewPassword, NOTHING_CHOSEN } from "./NewPassword";
import { SecondFactor } from "./SecondFactor";
import { access } from "./standing";
import { ROLES } from "./words";

/** One's own account: who one is here, password, second factor. */
export function AccountPage() {
  useTitle("My account");
  const me = useMe();
  if (!me) return null;
  return (
    <Stack maw={720} gap="lg">
      <div>
        <Title order={2}>{me.name}</Title>
        <Text>
          User name {me.username}. {ROLES[me.role].name}: {ROLES[me.role].may}
        </Text>
        {me.stations.length > 0 && <Text>Works at {me.stations.join(", ")}.</Text>}
      </div>
      {me.has_password && (
        <Card withBorder component="section" aria-label="Password">
          <Title order={3} mb="md">
            Password
          </Title>
          <ChangePassword me={me} />
        </Card>
      )}
      <Card withBorder component="section" aria-label="Second factor">
        <Title order={3} mb="md">
          Second factor
        </Title>
        <SecondFactor me={me} onChanged={() => void access.look()} />
      </Card>
    </Stack>
  );
}

/** Of somebody who has to have a second factor and has none yet: nothing else is possible before. */
export function EnrolPage({ me }: { me: Me }) {
  useTitle("Second factor");
  return (
    <Door title="A second factor is needed">
      <Text>
        {ROLES[me.role].name}s of this clinic sign in with a second factor. You have none yet, {me.name}.
      </Text>
      <SecondFactor me={me} onChanged={() => void access.look()} />
      <Button variant="subtle" onClick={() => void access.signOut()}>
        Sign out
      </Button>
    </Door>
  );
}

function ChangePassword({ me }: { me: Me }) {
  const [old, setOld] = useState("");
  const [chosen, setChosen] = useState(NOTHING_CHOSEN);
  const change = useMutation({
    mutationFn: () => api.changePassword({ password: old, new_password: chosen.password }),
    onSuccess: () => {
      setOld("");
      setChosen(NOTHING_CHOSEN);
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
          label="Present password"
          autoComplete="current-password"
          size="lg"
          value={old}
          error={fields.password}
          onChange={(event) => setOld(event.currentTarget.value)}
        />
        <NewPassword value={chosen} error={fields.new_password} onChange={setChosen} />
        <ProblemNote error={change.error} />
        <Group>
          <Button type="submit" disabled={old === "" || !isChosen(chosen)} loading={change.isPending}>
            Change the password
          </Button>
          {change.isSuccess && (
            <Text role="status">It is changed. Whoever was signed in as you elsewhere is signed out.</Text>
          )}
        </Group>
      </Stack>
    </form>
  );
}
