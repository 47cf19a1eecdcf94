import { Button, Group, MultiSelect, Radio, Stack, TextInput } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { type Account, api, ProblemError, type Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import type { Role } from "../auth/messages";

type Props =
  | { account: Account; onDone: () => void }
  | { account?: never; onDone: (code: Schemas["OneTimeCode"]) => void };

/**
 * Creates or changes an account. The account's owner chooses the password; the administrator never knows it.
 */
export function AccountForm(props: Props) {
  const { account } = props;
  const queries = useQueryClient();
  const [name, setName] = useState(account?.name ?? "");
  const [username, setUsername] = useState(account?.username ?? "");
  const [role, setRole] = useState<Role>(account?.role ?? "therapist");
  const [stations, setStations] = useState(account?.stations ?? []);
  const [openid, setOpenid] = useState(account?.openid ?? "");
  const loginMethods = useQuery({
    queryKey: ["ways-in"],
    queryFn: api.loginMethods,
    staleTime: Number.POSITIVE_INFINITY,
  });
  const filterOptions = useQuery({ queryKey: ["session-choices"], queryFn: api.sessionFilterOptions });
  const choices = [...new Set([...(filterOptions.data?.stations ?? []), ...stations])].sort();
  const save = useMutation({
    mutationFn: async () => {
      if (props.account) {
        const { id, updated_at } = props.account;
        const link = openid.trim() === (props.account.openid ?? "") ? {} : { openid };
        await api.updateAccount(id, { name, role, stations, updated_at, ...link });
        return null;
      }
      return api.createAccount({ username, name, role, stations });
    },
    onSuccess: (created) => {
      void queries.invalidateQueries({ queryKey: ["accounts"] });
      if (props.account) props.onDone();
      else if (created) props.onDone(created);
    },
  });
  const fields = save.error instanceof ProblemError ? save.error.fields : {};
  const submit = (event: FormEvent) => {
    event.preventDefault();
    save.mutate();
  };
  return (
    <form onSubmit={submit} noValidate>
      <Stack>
        <TextInput
          label={t("administration:form.name")}
          description={t("administration:form.nameHint")}
          required
          data-autofocus
          maxLength={100}
          value={name}
          error={fields.name}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        {!account && (
          <TextInput
            label={t("administration:form.username")}
            description={t("administration:form.usernameHint")}
            required
            maxLength={64}
            autoComplete="off"
            autoCapitalize="none"
            spellCheck={false}
            value={username}
            error={fields.username}
            onChange={(event) => setUsername(event.currentTarget.value)}
          />
        )}
        <RoleField value={role} onChange={setRole} />
        <MultiSelect
          label={t("administration:form.stations")}
          description={t("administration:form.stationsHint")}
          size="md"
          data={choices}
          value={stations}
          onChange={setStations}
        />
        {account && (loginMethods.data?.openid || account.openid) && (
          <IdentityField
            provider={loginMethods.data?.openid ?? null}
            value={openid}
            error={fields.openid}
            onChange={setOpenid}
          />
        )}
        <ProblemNote error={filterOptions.error ?? save.error} />
        <Group justify="end">
          <Button
            type="submit"
            loading={save.isPending}
            disabled={name.trim() === "" || username.trim() === ""}
          >
            {account ? t("administration:form.save") : t("administration:form.create")}
          </Button>
        </Group>
      </Stack>
    </form>
  );
}

function RoleField({ value, onChange }: { value: Role; onChange: (role: Role) => void }) {
  return (
    <Radio.Group
      label={t("administration:form.role")}
      value={value}
      onChange={(chosen) => onChange(chosen as Role)}
    >
      <Stack gap="xs" mt="xs">
        {Object.entries(t("auth:roles", { returnObjects: true })).map(([code, words]) => (
          <Radio key={code} size="md" value={code} label={words.name} description={words.may} />
        ))}
      </Stack>
    </Radio.Group>
  );
}

/** The account's identity at the OpenID provider. */
function IdentityField(props: {
  provider: string | null;
  value: string;
  error: string | undefined;
  onChange: (identity: string) => void;
}) {
  const { provider, value, error, onChange } = props;
  return (
    <TextInput
      label={t("administration:form.identity", {
        provider: provider ?? t("administration:form.theProvider"),
      })}
      description={t("administration:form.identityHint")}
      maxLength={255}
      autoComplete="off"
      autoCapitalize="none"
      spellCheck={false}
      value={value}
      error={error}
      onChange={(event) => onChange(event.currentTarget.value)}
    />
  );
}
