import { Box, Button, Card, Group, PasswordInput, Stack, Text, Title } from "@mantine/core";
import { IconLock, IconLogout } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { api, type Me } from "../api/client";
import { useAlive, useLive } from "../live/hooks";
import { formatSpan } from "../shared/format";
import { modeWords } from "../shared/modes";
import { ProblemNote } from "../shared/problem";
import { StateBar } from "../shared/StateBar";
import { useTitle } from "../shared/title";
import classes from "./access.module.css";
import { LOCKED } from "./doorWords";
import { OpenIdAgain } from "./OpenIdAgain";
import { access } from "./standing";

/**
 * Nobody at this browser may read a record now, but what goes on at the apparatus stays to be seen, without a patient's
 * name, and Stop works.
 */
export function LockScreen({ me }: { me: Me }) {
  useTitle(LOCKED.title);
  const [password, setPassword] = useState("");
  const unlock = useMutation({
    mutationFn: () => api.unlock(password),
    onSuccess: (now) => access.came(now),
    onError: () => setPassword(""),
  });
  const submit = (event: FormEvent) => {
    event.preventDefault();
    unlock.mutate();
  };
  return (
    <StateBar>
      <Box className={classes.locked ?? ""}>
        <GoingOn />
        <Card withBorder w="100%" maw={480} p="xl">
          <form onSubmit={submit} noValidate>
            <Stack>
              <Group gap="sm">
                <IconLock size={28} />
                <Title order={1} size="h2">
                  {LOCKED.title}
                </Title>
              </Group>
              <Text>{LOCKED.who(me.name)}</Text>
              {me.openid && <OpenIdAgain name={me.openid} then={LOCKED.thenUnlocked} />}
              {me.password && (
                <>
                  {/* For password managers; nothing that can be changed here. */}
                  <input type="text" autoComplete="username" value={me.username} readOnly hidden />
                  <PasswordInput
                    label={LOCKED.passwordOf(me.name)}
                    autoComplete="current-password"
                    autoFocus
                    size="lg"
                    value={password}
                    onChange={(event) => setPassword(event.currentTarget.value)}
                  />
                  <ProblemNote error={unlock.error} />
                  <Button type="submit" size="lg" disabled={password === ""} loading={unlock.isPending}>
                    {LOCKED.unlock}
                  </Button>
                </>
              )}
              {!me.password && !me.openid && <Text>{LOCKED.noPassword}</Text>}
              <Button
                variant="subtle"
                leftSection={<IconLogout size={20} />}
                onClick={() => void access.signOut()}
              >
                {LOCKED.signOut}
              </Button>
            </Stack>
          </form>
        </Card>
      </Box>
    </StateBar>
  );
}

/** What the apparatus does, to be read from a distance. */
function GoingOn() {
  const alive = useAlive();
  const mode = useLive("mode");
  const stop = useLive("stop");
  const run = useLive("run");
  if (!alive || !mode) return null;
  const moving = mode === "approaching" || mode === "playing" || mode === "paused" || mode === "returning";
  return (
    <Stack align="center" gap={0} data-testid="going-on">
      <Text fz={40} fw={700}>
        {modeWords({ mode, stop, run })}
      </Text>
      {moving && run && <Text fz={28}>{LOCKED.left(formatSpan(run.left_s))}</Text>}
    </Stack>
  );
}
