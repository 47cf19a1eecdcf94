import { Anchor, Stack, Text } from "@mantine/core";
import { IconExternalLink } from "@tabler/icons-react";
import { AGAIN } from "./authLayoutMessages";
import { openIdAddress } from "./openId";

/** For whoever shows at the clinic's own provider that it is still them. In another tab: what is shown here, and Stop, stay. */
export function OpenIdReauthentication({ name, then }: { name: string; then: string }) {
  return (
    <Stack gap={4}>
      <Anchor href={openIdAddress("")} target="_blank" rel="noopener" size="lg">
        {AGAIN.openId(name)}
        <IconExternalLink size={18} />
      </Anchor>
      <Text size="sm">{AGAIN.ownTab(then)}</Text>
    </Stack>
  );
}
