import { Badge, Button, Group, Modal, Skeleton, Stack, Switch, Table, Text, Title } from "@mantine/core";
import { IconUserPlus } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { useTitle } from "../../app/title";
import { type Account, api, type Schemas } from "../../lib/api/client";
import { ProblemNote } from "../../ui/ProblemNote";
import { useMe } from "../auth/hooks";
import { ROLES } from "../auth/messages";
import { AccountForm } from "./AccountForm";
import { ACCOUNTS, CODE } from "./messages";
import { OneTimeCode } from "./OneTimeCode";

/** The accounts with their roles and stations. */
export function AccountsPage() {
  useTitle(ACCOUNTS.title);
  const accounts = useQuery({ queryKey: ["accounts"], queryFn: api.accounts });
  const [creating, setMaking] = useState(false);
  const [oneTimeCode, setOneTimeCode] = useState<Schemas["OneTimeCode"] | null>(null);
  const items = accounts.data?.items ?? [];
  return (
    <Stack component="section" aria-label={ACCOUNTS.title}>
      <Group justify="space-between">
        <Title order={2} size="h3">
          {ACCOUNTS.title}
        </Title>
        <Button leftSection={<IconUserPlus size={20} />} onClick={() => setMaking(true)}>
          {ACCOUNTS.add}
        </Button>
      </Group>
      <ProblemNote error={accounts.error} />
      {accounts.isPending && <Skeleton h={200} />}
      {items.length > 0 && (
        <Table verticalSpacing="md" highlightOnHover>
          <Table.Thead>
            <Table.Tr>
              <Table.Th>{ACCOUNTS.name}</Table.Th>
              <Table.Th>{ACCOUNTS.role}</Table.Th>
              <Table.Th>{ACCOUNTS.stations}</Table.Th>
              <Table.Th>{ACCOUNTS.signsInWith}</Table.Th>
              <Table.Th>
                <span style={{ position: "absolute", left: -9999 }}>{ACCOUNTS.actions}</span>
              </Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {items.map((account) => (
              <Row key={account.id} account={account} onCode={setOneTimeCode} />
            ))}
          </Table.Tbody>
        </Table>
      )}
      <Modal opened={creating} onClose={() => setMaking(false)} title={ACCOUNTS.add} size="lg">
        <AccountForm
          onDone={(code) => {
            setMaking(false);
            setOneTimeCode(code);
          }}
        />
      </Modal>
      <Modal
        opened={oneTimeCode !== null}
        onClose={() => setOneTimeCode(null)}
        title={CODE.title}
        size="lg"
        closeOnClickOutside={false}
      >
        {oneTimeCode && <OneTimeCode code={oneTimeCode} onDone={() => setOneTimeCode(null)} />}
      </Modal>
    </Stack>
  );
}

function Row({ account, onCode }: { account: Account; onCode: (given: Schemas["OneTimeCode"]) => void }) {
  const me = useMe();
  const queries = useQueryClient();
  const [changing, setChanging] = useState(false);
  const [resetting, setResetting] = useState(false);
  const [factorLost, setLost] = useState(false);
  const disable = useMutation({
    // Without `updated_at`: disabling applies even if the account was changed meanwhile.
    mutationFn: (disabled: boolean) => api.updateAccount(account.id, { disabled }),
    onSettled: () => void queries.invalidateQueries({ queryKey: ["accounts"] }),
  });
  const reset = useMutation({
    mutationFn: () => api.resetAccount(account.id, { second_factor: factorLost }),
    onSuccess: (code) => {
      setResetting(false);
      onCode(code);
      void queries.invalidateQueries({ queryKey: ["accounts"] });
    },
  });
  const isOwn = account.id === me?.account_id;
  return (
    <Table.Tr {...(account.disabled_at && { c: "dimmed" })}>
      <Table.Td>
        <Text fw={600}>{account.name}</Text>
        <Text size="sm">{account.username}</Text>
        {account.disabled_at && <Badge color="gray">{ACCOUNTS.disabled}</Badge>}
      </Table.Td>
      <Table.Td>{ROLES[account.role].name}</Table.Td>
      <Table.Td>{ACCOUNTS.several(account.stations) || ACCOUNTS.all}</Table.Td>
      <Table.Td>{signsInWith(account)}</Table.Td>
      <Table.Td>
        <Group justify="end" gap="xs">
          <Button
            variant="default"
            onClick={() => setChanging(true)}
            aria-label={ACCOUNTS.changeOf(account.name)}
          >
            {ACCOUNTS.change}
          </Button>
          {!isOwn && !account.disabled_at && (
            <Button
              variant="default"
              onClick={() => setResetting(true)}
              aria-label={ACCOUNTS.newCodeFor(account.name)}
            >
              {ACCOUNTS.newCode}
            </Button>
          )}
          {!isOwn && (
            <Button
              variant="default"
              loading={disable.isPending}
              aria-label={(account.disabled_at ? ACCOUNTS.enableOf : ACCOUNTS.disableOf)(account.name)}
              onClick={() => disable.mutate(!account.disabled_at)}
            >
              {account.disabled_at ? ACCOUNTS.enable : ACCOUNTS.disable}
            </Button>
          )}
        </Group>
        <ProblemNote error={disable.error} />
        <Modal opened={changing} onClose={() => setChanging(false)} title={account.name} size="lg">
          <AccountForm account={account} onDone={() => setChanging(false)} />
        </Modal>
        <Modal
          opened={resetting}
          onClose={() => setResetting(false)}
          title={ACCOUNTS.newCodeFor(account.name)}
        >
          <Stack>
            <Text>{ACCOUNTS.resetting(account.name)}</Text>
            {account.second_factor && (
              <Switch
                size="md"
                label={ACCOUNTS.factorLost}
                checked={factorLost}
                onChange={(event) => setLost(event.currentTarget.checked)}
              />
            )}
            <ProblemNote error={reset.error} />
            <Group justify="end">
              <Button variant="default" onClick={() => setResetting(false)}>
                {ACCOUNTS.leave}
              </Button>
              <Button loading={reset.isPending} onClick={() => reset.mutate()}>
                {ACCOUNTS.reset}
              </Button>
            </Group>
          </Stack>
        </Modal>
      </Table.Td>
    </Table.Tr>
  );
}

function signsInWith(account: Account): string {
  const methods = [
    account.openid ? ACCOUNTS.clinicSignIn : [],
    account.password ? ACCOUNTS.password : [],
  ].flat();
  if (methods.length === 0) return ACCOUNTS.noPassword;
  return ACCOUNTS.several(account.second_factor ? [...methods, ACCOUNTS.secondFactor] : methods);
}
