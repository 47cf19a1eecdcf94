import { Button, Group, Modal, MultiSelect, Stack, Switch, Text, Title } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconLock } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import { useHasPermission } from "./hooks";

/** Query who may read a patient's record. */
export const useRecordAccess = (patientId: string) =>
  useQuery({ queryKey: ["record-access", patientId], queryFn: () => api.recordAccess(patientId) });

/** Shows who may read this record. An administrator can restrict it to a care team. */
export function RecordAccess({ patientId }: { patientId: string }) {
  const canAdminister = useHasPermission("administer");
  const [changing, dialog] = useDisclosure(false);
  const access = useRecordAccess(patientId);
  if (!access.data) return <ProblemNote error={access.error} />;
  const { restricted, team } = access.data;
  if (!restricted && !canAdminister) return null;
  return (
    <Stack gap="xs" component="section" aria-label={t("auth:record.whoSees")} data-testid="record-access">
      <Title order={2} size="h3">
        {t("auth:record.whoSees")}
      </Title>
      <Group gap="sm">
        {restricted && <IconLock size={20} />}
        <Text>
          {!restricted
            ? t("auth:record.unrestricted")
            : team.length > 0
              ? t("auth:record.restrictedTo", { names: team.map((one) => one.name) })
              : t("auth:record.restrictedToNobody")}
        </Text>
        {canAdminister && (
          <Button variant="default" onClick={dialog.open}>
            {restricted ? t("auth:record.change") : t("auth:record.restrict")}
          </Button>
        )}
      </Group>
      <Modal opened={changing} onClose={dialog.close} title={t("auth:record.whoSees")} size="lg">
        <ChangeRecordAccess patientId={patientId} access={access.data} onDone={dialog.close} />
      </Modal>
    </Stack>
  );
}

function ChangeRecordAccess(props: {
  patientId: string;
  access: Schemas["RecordAccess"];
  onDone: () => void;
}) {
  const queries = useQueryClient();
  const [restricted, setRestricted] = useState(props.access.restricted || props.access.team.length === 0);
  const [team, setTeam] = useState(props.access.team.map((member) => member.account_id));
  const accounts = useQuery({ queryKey: ["accounts"], queryFn: api.accounts });
  const save = useMutation({
    mutationFn: () => api.changeRecordAccess(props.patientId, { restricted, account_ids: team }),
    onSuccess: () => {
      void queries.invalidateQueries();
      props.onDone();
    },
  });
  const readers = (accounts.data?.items ?? []).filter(
    (account) => account.role !== "technician" && !account.disabled_at,
  );
  return (
    <Stack>
      <Switch
        size="lg"
        label={t("auth:record.onlyTeam")}
        checked={restricted}
        onChange={(event) => setRestricted(event.currentTarget.checked)}
      />
      {restricted && (
        <MultiSelect
          label={t("auth:record.team")}
          description={t("auth:record.teamHint")}
          size="md"
          searchable
          data={readers.map((account) => ({ value: account.id, label: account.name }))}
          value={team}
          onChange={setTeam}
        />
      )}
      <ProblemNote error={accounts.error ?? save.error} />
      <Group justify="end">
        <Button variant="default" onClick={props.onDone}>
          {t("auth:record.cancel")}
        </Button>
        <Button loading={save.isPending} onClick={() => save.mutate()}>
          {t("auth:record.save")}
        </Button>
      </Group>
    </Stack>
  );
}
