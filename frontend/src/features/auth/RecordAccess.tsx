import { Button, Group, Modal, MultiSelect, Stack, Switch, Text } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconLock } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Schemas } from "../../lib/api/client";
import { ProblemNote } from "../../ui/ProblemNote";
import { RECORD } from "./accountMessages";
import { useMay } from "./hooks";

/** Who sees a patient's record. */
export const useRecordAccess = (patientId: string) =>
  useQuery({ queryKey: ["record-access", patientId], queryFn: () => api.recordAccess(patientId) });

/** Who sees this record; an administrator can restrict it to a care team. */
export function RecordAccess({ patientId }: { patientId: string }) {
  const administers = useMay("administer");
  const [changing, dialog] = useDisclosure(false);
  const told = useRecordAccess(patientId);
  if (!told.data) return <ProblemNote error={told.error} />;
  const { restricted, team } = told.data;
  if (!restricted && !administers) return null;
  return (
    <Group gap="sm" data-testid="record-access">
      {restricted && (
        <>
          <IconLock size={20} />
          <Text>{RECORD.restrictedTo(team.map((one) => one.name))}</Text>
        </>
      )}
      {administers && (
        <Button variant="default" onClick={dialog.open}>
          {restricted ? RECORD.change : RECORD.restrict}
        </Button>
      )}
      <Modal opened={changing} onClose={dialog.close} title={RECORD.whoSees} size="lg">
        <Change patientId={patientId} now={told.data} onDone={dialog.close} />
      </Modal>
    </Group>
  );
}

function Change(props: { patientId: string; now: Schemas["RecordAccess"]; onDone: () => void }) {
  const queries = useQueryClient();
  const [restricted, setRestricted] = useState(props.now.restricted || props.now.team.length === 0);
  const [team, setTeam] = useState(props.now.team.map((one) => one.account_id));
  const accounts = useQuery({ queryKey: ["accounts"], queryFn: api.accounts });
  const save = useMutation({
    mutationFn: () => api.changeRecordAccess(props.patientId, { restricted, account_ids: team }),
    onSuccess: () => {
      void queries.invalidateQueries();
      props.onDone();
    },
  });
  const reads = (accounts.data?.items ?? []).filter((one) => one.role !== "technician" && !one.disabled_at);
  return (
    <Stack>
      <Switch
        size="lg"
        label={RECORD.onlyTeam}
        checked={restricted}
        onChange={(event) => setRestricted(event.currentTarget.checked)}
      />
      {restricted && (
        <MultiSelect
          label={RECORD.team}
          description={RECORD.teamMeans}
          size="md"
          searchable
          data={reads.map((one) => ({ value: one.id, label: one.name }))}
          value={team}
          onChange={setTeam}
        />
      )}
      <ProblemNote error={accounts.error ?? save.error} />
      <Group justify="end">
        <Button variant="default" onClick={props.onDone}>
          {RECORD.leave}
        </Button>
        <Button loading={save.isPending} onClick={() => save.mutate()}>
          {RECORD.save}
        </Button>
      </Group>
    </Stack>
  );
}
