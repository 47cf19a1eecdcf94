import "./catalogue";
import { Badge, Box, Button, Group, Modal, Skeleton, Stack, Switch, Text, Title } from "@mantine/core";
import { IconUserPlus } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { useTitle } from "../../app/title";
import { type Account, api, type Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { DataTable } from "../../ui/DataTable";
import { ProblemNote } from "../../ui/ProblemNote";
import type { Column } from "../../ui/tableRows";
import { AccessTokenList } from "../auth/AccessTokenList";
import { useMe } from "../auth/hooks";
import { AccountForm } from "./AccountForm";
import { OneTimeCode } from "./OneTimeCode";

/** The accounts with their roles and stations, and their access tokens. */
export function AccountsPage() {
  useTitle(t("administration:accounts.title"));
  const accounts = useQuery({ queryKey: ["accounts"], queryFn: api.accounts });
  const [creating, setCreating] = useState(false);
  const [oneTimeCode, setOneTimeCode] = useState<Schemas["OneTimeCode"] | null>(null);
  const items = accounts.data?.items ?? [];
  return (
    <Stack component="section" aria-label={t("administration:accounts.title")}>
      <Group justify="space-between">
        <Title order={2} size="h3">
          {t("administration:accounts.title")}
        </Title>
        <Button leftSection={<IconUserPlus size={20} />} onClick={() => setCreating(true)}>
          {t("administration:accounts.add")}
        </Button>
      </Group>
      <ProblemNote error={accounts.error} />
      {accounts.isPending && <Skeleton h={200} />}
      {items.length > 0 && (
        <DataTable
          name="accounts"
          label={t("administration:accounts.title")}
          columns={[...COLUMNS, actionsColumn(setOneTimeCode)]}
          rows={items}
          rowKey={({ id }) => id}
          isDimmed={({ disabled_at }) => disabled_at !== null}
        />
      )}
      <AllAccessTokens />
      <Modal
        opened={creating}
        onClose={() => setCreating(false)}
        title={t("administration:accounts.add")}
        size="lg"
      >
        <AccountForm
          onDone={(code) => {
            setCreating(false);
            setOneTimeCode(code);
          }}
        />
      </Modal>
      <Modal
        opened={oneTimeCode !== null}
        onClose={() => setOneTimeCode(null)}
        title={t("administration:code.title")}
        size="lg"
        closeOnClickOutside={false}
      >
        {oneTimeCode && <OneTimeCode code={oneTimeCode} onDone={() => setOneTimeCode(null)} />}
      </Modal>
    </Stack>
  );
}

/** The access tokens of all accounts. */
function AllAccessTokens() {
  const tokens = useQuery({ queryKey: ["access-tokens"], queryFn: api.accessTokens });
  const items = tokens.data?.items ?? [];
  return (
    <Stack component="section" aria-label={t("auth:tokens.title")} mt="lg">
      <Title order={3} size="h4">
        {t("auth:tokens.title")}
      </Title>
      <ProblemNote error={tokens.error} />
      {tokens.isSuccess && items.length === 0 && <Text>{t("auth:tokens.none")}</Text>}
      <AccessTokenList tokens={items} queryKey="access-tokens" revoke={api.revokeAccessToken} />
    </Stack>
  );
}

type OnCode = (code: Schemas["OneTimeCode"]) => void;

const COLUMNS: Column<Account>[] = [
  {
    key: "name",
    head: t("administration:accounts.name"),
    always: true,
    value: ({ name }) => name,
    cell: ({ name, username, disabled_at }) => (
      // A long name breaks, so that a telephone shows the buttons beside it.
      <Box miw="7.75rem" style={{ overflowWrap: "anywhere" }}>
        <Text fw={600}>{name}</Text>
        <Text size="sm">{username}</Text>
        {disabled_at && <Badge color="gray">{t("administration:accounts.disabled")}</Badge>}
      </Box>
    ),
  },
  {
    key: "role",
    below: "name",
    head: t("administration:accounts.role"),
    value: ({ role }) => t(`auth:roles.${role}.name`),
    cell: ({ role }) => t(`auth:roles.${role}.name`),
  },
  {
    key: "stations",
    onWide: true,
    head: t("administration:accounts.stations"),
    value: describeStation,
    cell: describeStation,
  },
  {
    key: "signsInWith",
    onWide: true,
    head: t("administration:accounts.signsInWith"),
    value: signsInWith,
    cell: signsInWith,
  },
];

/** The column with the buttons of an account. */
const actionsColumn = (onCode: OnCode): Column<Account> => ({
  key: "actions",
  head: t("administration:accounts.actions"),
  right: true,
  always: true,
  cell: (account) => <AccountActions account={account} onCode={onCode} />,
});

/** On a telephone the buttons of a row are narrow enough to be beside the name. */
const ACTION = { variant: "default", px: { base: 8, sm: 22 } } as const;

/** Changes, resets, disables or enables the account. Administrators can only change their own account. */
function AccountActions({ account, onCode }: { account: Account; onCode: OnCode }) {
  const isOwn = account.id === useMe()?.account_id;
  const [changing, setChanging] = useState(false);
  const [resetting, setResetting] = useState(false);
  const disable = useDisableAccount(account.id);
  return (
    <>
      <Group justify="end" gap={6} miw={{ base: 184, sm: 230 }}>
        <Button
          {...ACTION}
          onClick={() => setChanging(true)}
          aria-label={t("administration:accounts.changeOf", { name: account.name })}
        >
          {t("administration:accounts.change")}
        </Button>
        {!isOwn && !account.disabled_at && (
          <Button
            {...ACTION}
            onClick={() => setResetting(true)}
            aria-label={t("administration:accounts.newCodeFor", { name: account.name })}
          >
            {t("administration:accounts.newCode")}
          </Button>
        )}
        {!isOwn && (
          <DisableButton
            account={account}
            loading={disable.isPending}
            onClick={() => disable.mutate(!account.disabled_at)}
          />
        )}
      </Group>
      <ProblemNote error={disable.error} />
      <Modal opened={changing} onClose={() => setChanging(false)} title={account.name} size="lg">
        <AccountForm account={account} onDone={() => setChanging(false)} />
      </Modal>
      <ResetDialog account={account} opened={resetting} onClose={() => setResetting(false)} onCode={onCode} />
    </>
  );
}

/** Return a mutation that disables the account for `true` and enables it for `false`. */
function useDisableAccount(accountId: string) {
  const queries = useQueryClient();
  return useMutation({
    // Sent without `updated_at`, so that disabling applies even if the account was changed meanwhile.
    mutationFn: (disabled: boolean) => api.updateAccount(accountId, { disabled }),
    onSettled: () => void queries.invalidateQueries({ queryKey: ["accounts"] }),
  });
}

function DisableButton(props: { account: Account; loading: boolean; onClick: () => void }) {
  const { name, disabled_at } = props.account;
  const label = disabled_at
    ? t("administration:accounts.enableOf", { name })
    : t("administration:accounts.disableOf", { name });
  return (
    <Button {...ACTION} loading={props.loading} aria-label={label} onClick={props.onClick}>
      {disabled_at ? t("administration:accounts.enable") : t("administration:accounts.disable")}
    </Button>
  );
}

/** Resets the account. Its user gets a one-time code. */
function ResetDialog(props: { account: Account; opened: boolean; onClose: () => void; onCode: OnCode }) {
  const { account, opened, onClose } = props;
  const queries = useQueryClient();
  const [factorLost, setFactorLost] = useState(false);
  const reset = useMutation({
    mutationFn: () => api.resetAccount(account.id, { second_factor: factorLost }),
    onSuccess: (code) => {
      onClose();
      props.onCode(code);
      void queries.invalidateQueries({ queryKey: ["accounts"] });
    },
  });
  return (
    <Modal
      opened={opened}
      onClose={onClose}
      title={t("administration:accounts.newCodeFor", { name: account.name })}
    >
      <Stack>
        <Text>{t("administration:accounts.resetHint", { name: account.name })}</Text>
        {account.second_factor && (
          <Switch
            size="md"
            label={t("administration:accounts.factorLost")}
            checked={factorLost}
            onChange={(event) => setFactorLost(event.currentTarget.checked)}
          />
        )}
        <ProblemNote error={reset.error} />
        <Group justify="end">
          <Button variant="default" onClick={onClose}>
            {t("administration:accounts.cancel")}
          </Button>
          <Button loading={reset.isPending} onClick={() => reset.mutate()}>
            {t("administration:accounts.reset")}
          </Button>
        </Group>
      </Stack>
    </Modal>
  );
}

function describeStation({ stations }: Account): string {
  return t("common:format.list", { words: stations }) || t("administration:accounts.all");
}

function signsInWith(account: Account): string {
  const methods = [
    account.openid ? t("administration:accounts.singleSignOn") : [],
    account.password ? t("administration:accounts.password") : [],
  ].flat();
  if (methods.length === 0) return t("administration:accounts.noPassword");
  return t("common:format.list", {
    words: account.second_factor ? [...methods, t("administration:accounts.secondFactor")] : methods,
  });
}
