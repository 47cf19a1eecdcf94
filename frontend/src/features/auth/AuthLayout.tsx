import { Box, Card, Stack, Text, Title } from "@mantine/core";
import type { ReactNode } from "react";
import { Brand } from "../../app/Brand";
import classes from "./access.module.css";
import { useAuthState } from "./hooks";
import { LanguageChoice } from "./LanguageChoice";

/** The layout of the pages before sign-in: one card on an otherwise empty screen. */
export function AuthLayout({ title, children }: { title: string; children: ReactNode }) {
  const signedOut = useAuthState().is === "out";
  return (
    <Box className={classes.layout ?? ""} component="main">
      <Text fw={700} fz={28} c="var(--kata-brand)" mb="lg">
        <Brand />
      </Text>
      <Card withBorder w="100%" maw={480} p="xl">
        <Stack>
          <Title order={1} size="h2">
            {title}
          </Title>
          {children}
        </Stack>
      </Card>
      {signedOut && (
        <Box mt="md">
          <LanguageChoice />
        </Box>
      )}
    </Box>
  );
}
