import { Box, Button, Card, Group, PasswordInput, Stack, Text, Title } from "@mantine/core";
import { IconLock, IconLogout } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { useTitle } from "../../app/title";
import { api, type Me } from "../../lib/api/client";
import { formatDuration } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useAlive, useLive } from "../../lib/live/hooks";
import { AppFrame } from "../../safety/AppFrame";
import { describeMode } from "../../safety/modes";
import { ProblemNote } from "../../ui/ProblemNote";
import classes from "./access.module.css";
import { authStore } from "./authState";
import { OpenIdReauthentication } from "./OpenIdReauthentication";

/**
 * Hides all records until the user signs in again. The apparatus state stays visible without the patient's
 * name, and Stop works.
 */
export function LockScreen({ me, onBack }: { me: Me; onBack?: () => void }) {
  useTitle(t("auth:locked.title"));
  return (
    <AppFrame>
      <Box className={classes.locked ?? ""}>
        <ApparatusState />
        <Card withBorder w="100%" maw={480} p="xl">
          <Stack>
            <Group gap="sm">
              <IconLock size={28} />
              <Title order={1} size="h2">
                {t("auth:locked.title")}
              </Title>
            </Group>
            <Text>{t("auth:locked.who", { name: me.name })}</Text>
            {me.openid && (
              <OpenIdReauthentication name={me.openid} nextStep={t("auth:locked.thenUnlocked")} />
            )}
            {me.password && <UnlockForm me={me} />}
            {!me.password && !me.openid && <Text>{t("auth:locked.noPassword")}</Text>}
            {onBack && (
              <Button variant="default" onClick={onBack}>
                {t("patient-mode:backToQuestions")}
              </Button>
            )}
            <Button
              variant="subtle"
              leftSection={<IconLogout size={20} />}
              onClick={() => void authStore.signOut()}
            >
              {t("auth:locked.signOut")}
            </Button>
          </Stack>
        </Card>
      </Box>
    </AppFrame>
  );
}

/** Unlocks the screen with the password. */
function UnlockForm({ me }: { me: Me }) {
  const [password, setPassword] = useState("");
  const unlock = useMutation({
    mutationFn: () => api.unlock(password),
    onSuccess: (me) => authStore.signedIn(me),
    onError: () => setPassword(""),
  });
  const submit = (event: FormEvent) => {
    event.preventDefault();
    unlock.mutate();
  };
  return (
    <form onSubmit={submit} noValidate>
      <Stack>
        {/* This field contains the user name for password managers. */}
        <input type="text" autoComplete="username" value={me.username} readOnly hidden />
        <PasswordInput
          label={t("auth:locked.passwordOf", { name: me.name })}
          autoComplete="current-password"
          autoFocus
          size="lg"
          value={password}
          onChange={(event) => setPassword(event.currentTarget.value)}
        />
        <ProblemNote error={unlock.error} />
        <Button type="submit" size="lg" disabled={password === ""} loading={unlock.isPending}>
          {t("auth:locked.unlock")}
        </Button>
      </Stack>
    </form>
  );
}

/** Shows the apparatus state in large letters that can be read from a distance. */
function ApparatusState() {
  const alive = useAlive();
  const mode = useLive("mode");
  const stop = useLive("stop");
  const run = useLive("run");
  const torque = useLive("torque");
  if (!alive || !mode) return null;
  const moving = mode === "approaching" || mode === "playing" || mode === "paused" || mode === "returning";
  return (
    <Stack align="center" gap={0} data-testid="going-on">
      <Text fz={40} fw={700}>
        {describeMode({ mode, torque, stop, run })}
      </Text>
      {moving && run && run.left_s !== null && (
        <Text fz={28}>{t("auth:locked.left", { span: formatDuration(run.left_s) })}</Text>
      )}
    </Stack>
  );
}
