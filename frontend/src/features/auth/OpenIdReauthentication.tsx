import { Anchor, Stack, Text } from "@mantine/core";
import { IconExternalLink } from "@tabler/icons-react";
import { t } from "../../lib/i18n";
import { openIdAddress } from "./openId";

/**
 * A link to the OpenID provider for reauthentication. It opens another tab, so that this page and Stop stay
 * visible.
 */
export function OpenIdReauthentication({ name, nextStep }: { name: string; nextStep: string }) {
  return (
    <Stack gap={4}>
      <Anchor href={openIdAddress("")} target="_blank" rel="noopener" size="lg">
        {t("auth:reauthentication.openId", { provider: name })}
        <IconExternalLink size={18} />
      </Anchor>
      <Text size="sm">{t("auth:reauthentication.newTab", { nextStep })}</Text>
    </Stack>
  );
}
