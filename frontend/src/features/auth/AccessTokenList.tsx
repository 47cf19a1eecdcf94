import { Button, Group, Stack, Text } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import type { Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";

type Token = Schemas["AccessToken"] | Schemas["AccountAccessToken"];

/** Access tokens, each with a button that revokes it. `queryKey`: key of the list's query, which is loaded again after a revocation. */
export function AccessTokenList(props: {
  tokens: Token[];
  queryKey: string;
  revoke: (id: string) => Promise<void>;
}) {
  const queries = useQueryClient();
  const revoke = useMutation({
    mutationFn: props.revoke,
    onSettled: () => void queries.invalidateQueries({ queryKey: [props.queryKey] }),
  });
  return (
    <Stack>
      {props.tokens.map((token) => (
        <Group key={token.id} justify="space-between" wrap="nowrap">
          <div style={{ minWidth: 0 }}>
            <Text fw={600} style={{ overflowWrap: "anywhere" }}>
              {token.name}
            </Text>
            {"owner" in token && <Text>{token.owner}</Text>}
            <Text size="sm">
              {t("auth:tokens.validity", {
                created: formatMoment(token.created_at),
                expires: formatMoment(token.expires_at),
              })}{" "}
              {token.last_used_at
                ? t("auth:tokens.lastUsed", { moment: formatMoment(token.last_used_at) })
                : t("auth:tokens.neverUsed")}
            </Text>
          </div>
          <Button
            variant="default"
            style={{ flexShrink: 0 }}
            aria-label={t("auth:tokens.revokeOf", { name: token.name })}
            loading={revoke.isPending && revoke.variables === token.id}
            onClick={() => revoke.mutate(token.id)}
          >
            {t("auth:tokens.revoke")}
          </Button>
        </Group>
      ))}
      <ProblemNote error={revoke.error} />
    </Stack>
  );
}
