import { Badge, Button, Group, Modal, Skeleton, Stack, Switch, Table, Text, Title } from "@mantine/core";
import { IconUserPlus } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { useMe } from "../access/hooks";
import { ROLES } from "../access/words";
import { type Account, api, type Schemas } from "../api/client";
import { ProblemNote } from "../shared/problem";
import { useTitle } from "../shared/title";
import { AccountForm } from "./AccountForm";
import { OneTimeCode } from "./OneTimeCode";

/** Who may sign in, as what, and where. */
export function AccountsPage() {
  useTitle("Accounts");
  const accounts = useQuery({ queryKey: ["accounts"], queryFn: api.accounts });
  const [making, setMaking] = useState(false);
  const [given, setGiven] = useState<Schemas["OneTimeCode"] | null>(null);
  const items = accounts.data?.items ?? [];
  return (
    <Stack component="section" aria-label="Accounts">
      <Group justify="space-between">
        <Title order={2} size="h3">
          Accounts
        </Title>
        <Button leftSection={<IconUserPlus size={20} />} onClick={() => setMaking(true)}>
          New account
        </Button>
      </Group>
      <ProblemNote error={accounts.error} />
      {accounts.isPending && <Skeleton h={200} />}
      {items.length > 0 && (
        <Table verticalSpacing="md" highlightOnHover>
          <Table.Thead>
            <Table.Tr>
              <Table.Th>Name</Table.Th>
              <Table.Th>Role</Table.Th>
              <Table.Th>Stations</Table.Th>
              <Table.Th>Signs in with</Table.Th>
              <Table.Th>
                <span style={{ position: "absolute", left: -9999 }}>What can be done</span>
              </Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {items.map((account) => (
              <Row key={account.id} account={account} onGiven={setGiven} />
            ))}
          </Table.Tbody>
        </Table>
      )}
      <Modal opened={making} onClose={() => setMaking(false)} title="New account" size="lg">
        <AccountForm
          onDone={(made) => {
            setMaking(false);
            setGiven(made);
          }}
        />
      </Modal>
      <Modal
        opened={given !== null}
        onClose={() => setGiven(null)}
        title="One-time code"
        size="lg"
        closeOnClickOutside={false}
      >
        {given && <OneTimeCode given={given} onDone={() => setGiven(null)} />}
      </Modal>
    </Stack>
  );
}

function Row({ account, onGiven }: { account: Account; onGiven: (given: Schemas["OneTimeCode"]) => void }) {
  const me = useMe();
  const queries = useQueryClient();
  const [changing, setChanging] = useState(false);
  const [resetting, setResetting] = useState(false);
  const [lost, setLost] = useState(false);
  const disable = useMutation({
    // Whoever is to be shut out is shut out, whatever else has changed of the account meanwhile.
    mutationFn: (disabled: boolean) => api.updateAccount(account.id, { disabled }),
    onSettled: () => void queries.invalidateQueries({ queryKey: ["accounts"] }),
  });
  const reset = useMutation({
    mutationFn: () => api.resetAccount(account.id, { second_factor: lost }),
    onSuccess: (told) => {
      setResetting(false);
      onGiven(told);
      void queries.invalidateQueries({ queryKey: ["accounts"] });
    },
  });
  const mine = account.id === me?.account_id;
  return (
    <Table.Tr {...(account.disabled_at && { c: "dimmed" })}>
      <Table.Td>
        <Text fw={600}>{account.name}</Text>
        <Text size="sm">{account.username}</Text>
        {account.disabled_at && <Badge color="gray">Disabled</Badge>}
      </Table.Td>
      <Table.Td>{ROLES[account.role].name}</Table.Td>
      <Table.Td>{account.stations.join(", ") || "All"}</Table.Td>
      <Table.Td>{signsInWith(account)}</Table.Td>
      <Table.Td>
        <Group justify="end" gap="xs">
          <Button variant="default" onClick={() => setChanging(true)} aria-label={`Change ${account.name}`}>
            Change
          </Button>
          {!mine && !account.disabled_at && (
            <Button
              variant="default"
              onClick={() => setResetting(true)}
              aria-label={`New code for ${account.name}`}
            >
              New code
            </Button>
          )}
          {!mine && (
            <Button
              variant="default"
              loading={disable.isPending}
              aria-label={`${account.disabled_at ? "Enable" : "Disable"} ${account.name}`}
              onClick={() => disable.mutate(!account.disabled_at)}
            >
              {account.disabled_at ? "Enable" : "Disable"}
            </Button>
          )}
        </Group>
        <ProblemNote error={disable.error} />
        <Modal opened={changing} onClose={() => setChanging(false)} title={account.name} size="lg">
          <AccountForm account={account} onDone={() => setChanging(false)} />
        </Modal>
        <Modal opened={resetting} onClose={() => setResetting(false)} title={`New code for ${account.name}`}>
          <Stack>
            <Text>
              With a one-time code {account.name} sets a new password. Until then nobody signs in with this
              account, and whoever is signed in with it is signed out. Make sure who asks for it.
            </Text>
            {account.second_factor && (
              <Switch
                size="md"
                label="The second factor is lost, too: take it away"
                checked={lost}
                onChange={(event) => setLost(event.currentTarget.checked)}
              />
            )}
            <ProblemNote error={reset.error} />
            <Group justify="end">
              <Button variant="default" onClick={() => setResetting(false)}>
                Leave it as it is
              </Button>
              <Button loading={reset.isPending} onClick={() => reset.mutate()}>
                Make a new code
              </Button>
            </Group>
          </Stack>
        </Modal>
      </Table.Td>
    </Table.Tr>
  );
}

function signsInWith(account: Account): string {
  const ways = [account.openid && "The clinic's own sign-in", account.password && "Password"].filter(Boolean);
  if (ways.length === 0) return "No password yet";
  return [...ways, account.second_factor && "Second factor"].filter(Boolean).join(", ");
}
