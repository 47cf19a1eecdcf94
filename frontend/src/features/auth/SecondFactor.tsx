import { Button, Group, Stack, Text, TextInput } from "@mantine/core";
import { IconCircleCheck, IconDeviceMobile, IconPrinter } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { api, type Me, ProblemError, type Schemas } from "../../lib/api/client";
import { ProblemNote } from "../../ui/ProblemNote";
import classes from "./access.module.css";
import { SECOND_FACTOR } from "./accountMessages";
import { ReauthenticateForm } from "./ReauthenticateForm";

/** The user's second factor: its state, and the actions to set it up or remove it. */
export function SecondFactor({ me, onChanged }: { me: Me; onChanged: () => void }) {
  const [enrolment, setEnrolment] = useState<Schemas["SecondFactorBegun"] | null>(null);
  const [codes, setCodes] = useState<string[] | null>(null);
  if (codes) {
    return (
      <RecoveryCodes
        codes={codes}
        onDone={() => {
          setCodes(null);
          setEnrolment(null);
          onChanged();
        }}
      />
    );
  }
  if (enrolment) return <Enrol enrolment={enrolment} onCodes={setCodes} />;
  return (
    <Stack align="start">
      {me.second_factor ? (
        <Group gap="xs">
          <IconCircleCheck size={22} />
          <Text>{SECOND_FACTOR.there}</Text>
        </Group>
      ) : (
        <Text>{SECOND_FACTOR.none}</Text>
      )}
      {me.second_factor ? (
        <ReauthenticateForm action={api.removeSecondFactor} onDone={onChanged} variant="default">
          {SECOND_FACTOR.remove}
        </ReauthenticateForm>
      ) : (
        <ReauthenticateForm
          action={api.beginSecondFactor}
          onDone={setEnrolment}
          leftSection={<IconDeviceMobile size={20} />}
        >
          {SECOND_FACTOR.begin}
        </ReauthenticateForm>
      )}
    </Stack>
  );
}

/** The QR code for the authenticator app, and the field that confirms the app's first code. */
function Enrol(props: { enrolment: Schemas["SecondFactorBegun"]; onCodes: (codes: string[]) => void }) {
  const { enrolment } = props;
  const [code, setCode] = useState("");
  const confirm = useMutation({
    mutationFn: () => api.confirmSecondFactor(code),
    onSuccess: (recovery) => props.onCodes(recovery.codes),
  });
  const submit = (event: FormEvent) => {
    event.preventDefault();
    confirm.mutate();
  };
  return (
    <Stack>
      <Text>{SECOND_FACTOR.scan}</Text>
      {/* As an image, so that no script in it can run. */}
      <img className={classes.qr ?? ""} alt={SECOND_FACTOR.picture} src={enrolment.picture} />
      <Text>
        {SECOND_FACTOR.key}{" "}
        <Text span ff="monospace" fw={600} style={{ overflowWrap: "anywhere" }} data-testid="secret">
          {new URL(enrolment.address).searchParams.get("secret")}
        </Text>
      </Text>
      <form onSubmit={submit} noValidate>
        <Stack>
          <TextInput
            className={classes.code ?? ""}
            label={SECOND_FACTOR.digits}
            autoComplete="one-time-code"
            inputMode="numeric"
            maxLength={7}
            size="lg"
            value={code}
            error={confirm.error instanceof ProblemError ? confirm.error.fields.code : undefined}
            onChange={(event) => setCode(event.currentTarget.value)}
          />
          <ProblemNote error={confirm.error} />
          <Button type="submit" size="lg" disabled={code.trim().length < 6} loading={confirm.isPending}>
            {SECOND_FACTOR.confirm}
          </Button>
        </Stack>
      </form>
    </Stack>
  );
}

/** The recovery codes, shown once. */
function RecoveryCodes({ codes, onDone }: { codes: string[]; onDone: () => void }) {
  return (
    <Stack>
      <Text fw={600}>{SECOND_FACTOR.recovery}</Text>
      <ul className={classes.codes ?? ""} data-testid="recovery-codes">
        {codes.map((code) => (
          <li key={code}>{code}</li>
        ))}
      </ul>
      <Group>
        <Button variant="default" leftSection={<IconPrinter size={20} />} onClick={() => window.print()}>
          {SECOND_FACTOR.print}
        </Button>
        <Button onClick={onDone}>{SECOND_FACTOR.kept}</Button>
      </Group>
    </Stack>
  );
}
