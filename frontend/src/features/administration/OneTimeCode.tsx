import "./catalogue";
import { Button, CopyButton, Group, Stack, Text } from "@mantine/core";
import { IconCheck, IconCopy } from "@tabler/icons-react";
import type { Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";

/** Shows a one-time code once, so that the administrator can hand it over. */
export function OneTimeCode({ code, onDone }: { code: Schemas["OneTimeCode"]; onDone: () => void }) {
  const link = `${location.origin}/set-password#code=${encodeURIComponent(code.code)}`;
  return (
    <Stack>
      <Text>{t("administration:code.handOver", { until: formatMoment(code.until) })}</Text>
      <Text>
        {t("administration:code.username")}{" "}
        <Text span fw={600} data-testid="username">
          {code.account.username}
        </Text>
      </Text>
      <Text>
        {t("administration:code.code")}{" "}
        <Text span fw={600} ff="monospace" fz="lg" data-testid="code" style={{ overflowWrap: "anywhere" }}>
          {code.code}
        </Text>
      </Text>
      <Text size="sm">{t("administration:code.where")}</Text>
      <Group>
        <CopyButton value={link}>
          {({ copied, copy }) => (
            <Button
              variant="default"
              leftSection={copied ? <IconCheck size={20} /> : <IconCopy size={20} />}
              onClick={copy}
            >
              {copied ? t("administration:code.copied") : t("administration:code.copy")}
            </Button>
          )}
        </CopyButton>
        <Button onClick={onDone}>{t("administration:code.done")}</Button>
      </Group>
    </Stack>
  );
}
