import { Anchor, Stack, Text } from "@mantine/core";
import { IconExternalLink } from "@tabler/icons-react";
import { AGAIN } from "./authLayoutMessages";
import { openIdAddress } from "./openId";

/**
 * A link to the OpenID provider for reauthentication. It opens another tab, so that this page and Stop stay
 * visible.
 */
export function OpenIdReauthentication({ name, nextStep }: { name: string; nextStep: string }) {
  return (
    <Stack gap={4}>
      <Anchor href={openIdAddress("")} target="_blank" rel="noopener" size="lg">
        {AGAIN.openId(name)}
        <IconExternalLink size={18} />
      </Anchor>
      <Text size="sm">{AGAIN.ownTab(nextStep)}</Text>
    </Stack>
  );
}
