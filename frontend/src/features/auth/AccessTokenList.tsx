import { Button, Text } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import type { Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { DataTable } from "../../ui/DataTable";
import { ProblemNote } from "../../ui/ProblemNote";
import type { Column } from "../../ui/tableRows";

type Token = Schemas["AccessToken"] & Partial<Pick<Schemas["AccountAccessToken"], "owner">>;

/** A table of access tokens, each with a button that revokes it. `queryKey`: key of the table's query, which is loaded again after a revocation. */
export function AccessTokenList(props: {
  tokens: Token[];
  queryKey: string;
  revoke: (id: string) => Promise<void>;
}) {
  const { tokens, queryKey } = props;
  const queries = useQueryClient();
  const revoke = useMutation({
    mutationFn: props.revoke,
    onSettled: () => void queries.invalidateQueries({ queryKey: [queryKey] }),
  });
  const actions: Column<Token> = {
    key: "actions",
    head: t("auth:tokens.actions"),
    right: true,
    always: true,
    cell: ({ id, name }) => (
      <Button
        variant="default"
        aria-label={t("auth:tokens.revokeOf", { name })}
        loading={revoke.isPending && revoke.variables === id}
        onClick={() => revoke.mutate(id)}
      >
        {t("auth:tokens.revoke")}
      </Button>
    ),
  };
  return (
    <>
      {tokens.length > 0 && (
        <DataTable
          name={queryKey}
          label={t("auth:tokens.title")}
          columns={[TOKEN, ...(tokens.some(({ owner }) => owner) ? [OWNER] : []), ...MOMENTS, actions]}
          rows={tokens}
          rowKey={({ id }) => id}
        />
      )}
      <ProblemNote error={revoke.error} />
    </>
  );
}

const TOKEN: Column<Token> = {
  key: "token",
  head: t("auth:tokens.token"),
  always: true,
  value: ({ name }) => name,
  cell: ({ name }) => (
    <Text fw={600} style={{ overflowWrap: "anywhere" }}>
      {name}
    </Text>
  ),
};

const OWNER: Column<Token> = {
  key: "owner",
  head: t("auth:tokens.owner"),
  value: ({ owner }) => owner ?? null,
  cell: ({ owner }) => owner,
};

const MOMENTS: Column<Token>[] = [
  {
    key: "created",
    head: t("auth:tokens.created"),
    value: ({ created_at }) => created_at,
    cell: ({ created_at }) => formatMoment(created_at),
  },
  {
    key: "expires",
    head: t("auth:tokens.expires"),
    value: ({ expires_at }) => expires_at,
    cell: ({ expires_at }) => formatMoment(expires_at),
  },
  {
    key: "used",
    head: t("auth:tokens.used"),
    value: ({ last_used_at }) => last_used_at,
    cell: ({ last_used_at }) => (last_used_at ? formatMoment(last_used_at) : t("auth:tokens.neverUsed")),
  },
];
