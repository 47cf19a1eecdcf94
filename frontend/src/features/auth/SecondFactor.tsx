import { Button, Group, PasswordInput, Stack, Text, TextInput } from "@mantine/core";
import { IconCircleCheck, IconDeviceMobile, IconPrinter } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { api, type Me, ProblemError, type Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import classes from "./access.module.css";
import { CodeField } from "./CodeField";
import { OpenIdReauthentication } from "./OpenIdReauthentication";
import { ReauthenticateForm } from "./ReauthenticateForm";

/** The user's second factor: its state, and the actions to set it up or remove it. */
export function SecondFactor({ me, onChanged }: { me: Me; onChanged: () => void }) {
  const [enrolment, setEnrolment] = useState<Schemas["SecondFactorSetup"] | null>(null);
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
        <Group gap="xs" wrap="nowrap" align="start">
          <IconCircleCheck size={22} style={{ flexShrink: 0 }} />
          <Text>{t("auth:secondFactor.configured")}</Text>
        </Group>
      ) : (
        <Text>{t("auth:secondFactor.none")}</Text>
      )}
      {me.second_factor ? (
        <RemoveSecondFactor me={me} onDone={onChanged} />
      ) : (
        <ReauthenticateForm
          action={api.beginSecondFactor}
          onDone={setEnrolment}
          leftSection={<IconDeviceMobile size={20} />}
        >
          {t("auth:secondFactor.begin")}
        </ReauthenticateForm>
      )}
    </Stack>
  );
}

/** Removes the second factor. This needs the password and a code of the second factor. */
function RemoveSecondFactor({ me, onDone }: { me: Me; onDone: () => void }) {
  const [open, setOpen] = useState(false);
  const [password, setPassword] = useState("");
  const [code, setCode] = useState("");
  const remove = useMutation({
    mutationFn: () => api.removeSecondFactor(me.password ? password : null, code),
    onSuccess: onDone,
  });
  const openIdNeeded = remove.error instanceof ProblemError && remove.error.code === "openid_needed";
  if (!open) {
    return (
      <Button variant="default" onClick={() => setOpen(true)}>
        {t("auth:secondFactor.remove")}
      </Button>
    );
  }
  const submit = (event: FormEvent) => {
    event.preventDefault();
    remove.mutate();
  };
  return (
    <form onSubmit={submit} noValidate>
      <Stack>
        {me.password && (
          <PasswordInput
            label={t("auth:reauthentication.password")}
            autoComplete="current-password"
            autoFocus
            size="lg"
            value={password}
            onChange={(event) => setPassword(event.currentTarget.value)}
          />
        )}
        <CodeField value={code} onChange={setCode} focused={!me.password} />
        {openIdNeeded && me.openid ? (
          <OpenIdReauthentication name={me.openid} nextStep={t("auth:reauthentication.pressAgain")} />
        ) : (
          <ProblemNote error={remove.error} />
        )}
        <Group>
          <Button
            type="submit"
            variant="default"
            disabled={(me.password && password === "") || code.trim() === ""}
            loading={remove.isPending}
          >
            {t("auth:secondFactor.remove")}
          </Button>
        </Group>
      </Stack>
    </form>
  );
}

/** Shows the QR code for the authenticator app, and the field in which the user confirms the app's first code. */
function Enrol(props: { enrolment: Schemas["SecondFactorSetup"]; onCodes: (codes: string[]) => void }) {
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
      <Text>{t("auth:secondFactor.scan")}</Text>
      {/* Shown as an image, so that no script in it can run. */}
      <img className={classes.qr ?? ""} alt={t("auth:secondFactor.picture")} src={enrolment.picture} />
      <Text>
        {t("auth:secondFactor.key")}{" "}
        <Text span ff="monospace" fw={600} style={{ overflowWrap: "anywhere" }} data-testid="secret">
          {new URL(enrolment.address).searchParams.get("secret")}
        </Text>
      </Text>
      <form onSubmit={submit} noValidate>
        <Stack>
          <TextInput
            className={classes.code ?? ""}
            label={t("auth:secondFactor.digits")}
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
            {t("auth:secondFactor.confirm")}
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
      <Text fw={600}>{t("auth:secondFactor.recovery")}</Text>
      <ul className={classes.codes ?? ""} data-testid="recovery-codes">
        {codes.map((code) => (
          <li key={code}>{code}</li>
        ))}
      </ul>
      <Group>
        <Button variant="default" leftSection={<IconPrinter size={20} />} onClick={() => window.print()}>
          {t("auth:secondFactor.print")}
        </Button>
        <Button onClick={onDone}>{t("auth:secondFactor.stored")}</Button>
      </Group>
    </Stack>
  );
}
