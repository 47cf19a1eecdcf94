import { Alert, Button, Group, List, Modal, Stack, Text } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconRotate2 } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { api, type Schemas } from "../../lib/api/client";
import { useAlive, useLive } from "../../lib/live/hooks";
import { ProblemNote } from "../../ui/ProblemNote";
import { useMayOperate } from "../auth/hooks";
import { STANDS } from "./messages";

type Side = Schemas["Live"]["side"];

/** Shows for which shoulder the apparatus is set up. Turning it is manual work; the user confirms it here. */
export function ApparatusSideCard({ wanted }: { wanted: Side | undefined }) {
  const operates = useMayOperate();
  const alive = useAlive();
  const mode = useLive("mode");
  const side = useLive("side");
  const [asking, dialog] = useDisclosure(false);
  const other: Side = side === "right" ? "left" : "right";
  const turn = useMutation({ mutationFn: () => api.setSide(other), onSuccess: dialog.close });
  const differs = wanted !== undefined && side !== null && wanted !== side;
  const button = operates && (
    <Button
      size="md"
      variant={differs ? "filled" : "default"}
      leftSection={<IconRotate2 size={22} />}
      disabled={!alive || mode !== "idle"}
      onClick={dialog.open}
    >
      {STANDS.turned(other)}
    </Button>
  );
  return (
    <div className={alive ? "" : "stale"}>
      {differs ? (
        <Alert variant="outline" color="gray" title={STANDS.standsFor(side)}>
          <Group justify="space-between">
            <Text>{STANDS.treated(wanted)}</Text>
            {button}
          </Group>
        </Alert>
      ) : (
        <Group justify="space-between">
          <Text>{side && STANDS.standsFor(side)}</Text>
          {button}
        </Group>
      )}
      <Modal opened={asking} onClose={dialog.close} title={STANDS.turning(other)} size="lg">
        <Stack>
          <Text>{STANDS.before}</Text>
          <List>
            <List.Item>{STANDS.armOut}</List.Item>
            <List.Item>{STANDS.isTurned(other)}</List.Item>
            <List.Item>{STANDS.armIn}</List.Item>
          </List>
          <ProblemNote error={turn.error} />
          <Group>
            <Button size="xl" loading={turn.isPending} onClick={() => turn.mutate()}>
              {STANDS.confirm(other)}
            </Button>
            <Button size="xl" variant="default" onClick={dialog.close}>
              {STANDS.notNow}
            </Button>
          </Group>
        </Stack>
      </Modal>
    </div>
  );
}
