import { Button, Stack, Text, TextInput } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useNavigate } from "@tanstack/react-router";
import { type FormEvent, type ReactNode, useState } from "react";
import { useTitle } from "../../app/title";
import { api, type Me, ProblemError } from "../../lib/api/client";
import { ButtonLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { AuthLayout } from "./AuthLayout";
import classes from "./access.module.css";
import { PASSWORD, SET_UP } from "./authLayoutMessages";
import { authStore } from "./authState";
import { fromLink } from "./fromLink";
import { isChosen, NewPassword, NOTHING_CHOSEN } from "./NewPassword";
import { UserNameField } from "./UserNameField";

/** The first administrator, by the link that the service printed. */
export function SetUpPage() {
  const [link] = useState(() => fromLink("secret"));
  const [name, setName] = useState("");
  const [username, setUsername] = useState("");
  const [chosen, setChosen] = useState(NOTHING_CHOSEN);
  const done = useSignedIn();
  const setUp = useMutation({
    mutationFn: () => api.setUp({ secret: link, username, name, password: chosen.password }),
    onSuccess: done,
  });
  const fields = setUp.error instanceof ProblemError ? setUp.error.fields : {};
  useTitle(SET_UP.title);
  if (!link) {
    return (
      <AuthLayout title={SET_UP.title}>
        <Text>{SET_UP.noLink}</Text>
      </AuthLayout>
    );
  }
  return (
    <AuthLayout title={SET_UP.title}>
      <Text>{SET_UP.means}</Text>
      <Form
        label={SET_UP.make}
        ready={isChosen(chosen) && name.trim() !== "" && username.trim() !== ""}
        pending={setUp.isPending}
        onSubmit={() => setUp.mutate()}
      >
        <TextInput
          label={SET_UP.name}
          description={SET_UP.nameMeans}
          autoComplete="name"
          size="lg"
          value={name}
          error={fields.name}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <UserNameField
          description={SET_UP.usernameMeans}
          value={username}
          error={fields.username}
          onChange={setUsername}
        />
        <NewPassword value={chosen} error={fields.password} onChange={setChosen} />
        <ProblemNote error={setUp.error} />
      </Form>
    </AuthLayout>
  );
}

/** A password is set with the one-time code that an administrator gave: at the beginning, or when it was forgotten. */
export function SetPasswordPage() {
  const [code, setCode] = useState(() => fromLink("code"));
  const [username, setUsername] = useState("");
  const [chosen, setChosen] = useState(NOTHING_CHOSEN);
  const done = useSignedIn();
  const navigate = useNavigate();
  const set = useMutation({
    mutationFn: async () => {
      const { password } = chosen;
      await api.setPassword({ username, code, password });
      // With a second factor it takes its code, too, which is asked for where one signs in.
      return api.signIn({ username, password }).catch(() => null);
    },
    onSuccess: (me) => (me ? done(me) : navigate({ to: "/", replace: true })),
  });
  const fields = set.error instanceof ProblemError ? set.error.fields : {};
  useTitle(PASSWORD.setting);
  return (
    <AuthLayout title={PASSWORD.setting}>
      <Text>{PASSWORD.settingMeans}</Text>
      <Form
        label={PASSWORD.set}
        ready={isChosen(chosen) && code.trim() !== "" && username.trim() !== ""}
        pending={set.isPending}
        onSubmit={() => set.mutate()}
      >
        <UserNameField value={username} error={fields.username} onChange={setUsername} />
        <TextInput
          className={classes.code ?? ""}
          label={PASSWORD.code}
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
      </Form>
      <ButtonLink to="/" variant="subtle">
        {PASSWORD.back}
      </ButtonLink>
    </AuthLayout>
  );
}

/** Whoever has just set a password is signed in, and goes to the beginning. The code is in no address any more. */
function useSignedIn() {
  const navigate = useNavigate();
  return (me: Me) => {
    authStore.came(me);
    void navigate({ to: "/", replace: true });
  };
}

function Form(props: {
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
